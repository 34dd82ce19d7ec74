"""Re-identifying joint zeros after a knock or a motor replacement, with the last calibration as prior."""

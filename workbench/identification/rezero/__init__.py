"""Joint zeros found again after a knock or a new motor, with the last calibration as prior knowledge."""

"""Calibrations over time: what moved in an arm and since when, and which arms of a fleet are wearing."""

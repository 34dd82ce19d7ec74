"""Compensation: what a controller that knows less than the calibrated model can still make of it."""

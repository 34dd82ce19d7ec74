"""Calibrated arms over the years: calibrations over time and fleets."""

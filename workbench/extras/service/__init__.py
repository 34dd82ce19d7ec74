"""Calibrated arms later on: verified on fresh poses, rezeroed after a collision."""

"""Paths: trajectories planned, corrected with the calibrated arm, and checked with a pencil."""

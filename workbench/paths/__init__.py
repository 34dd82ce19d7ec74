"""Paths: trajectories planned, and corrected with the calibrated arm."""

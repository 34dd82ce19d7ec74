"""Trajectories: planned, played on both arms, and corrected."""

"""Planned and corrected trajectories as tables, figures and JSON."""

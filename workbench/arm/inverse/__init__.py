"""Inverse kinematics: all branches that reach a pose, bent arms included, and quick following."""

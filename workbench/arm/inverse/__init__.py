"""Inverse kinematics: all branches that reach a pose, deflected arms included, and quick following."""

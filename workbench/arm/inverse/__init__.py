"""Inverse kinematics: all branches that reach a pose, deflected arms included, and fast following."""

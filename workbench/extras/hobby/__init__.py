"""Hobby arms of servo motors: motor counts and LeRobot's calibrations against the URDF."""

"""Hobby arms of servo motors: motor counts and LeRobot's files against the URDF, leader against follower."""

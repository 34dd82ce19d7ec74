"""Clearance, backlash and stiffness of joints from inclinometers and added loads."""

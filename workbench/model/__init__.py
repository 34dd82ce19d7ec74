"""What a robot does: poses, joints for a pose, moments, and their sensitivity to the constants."""

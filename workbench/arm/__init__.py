"""The arm: its chain, constants, effects and frames; poses, joint positions for a pose, and moments."""

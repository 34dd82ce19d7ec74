"""A Python file that computes with the whole calibrated model, effects included, and needs numpy alone."""

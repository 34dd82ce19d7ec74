"""Poses to measure at without a plate: the most informative within limits, in a short order."""

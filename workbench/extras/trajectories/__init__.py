"""Trajectories: planned, played on both arms, corrected, and checked with pencil and paper."""

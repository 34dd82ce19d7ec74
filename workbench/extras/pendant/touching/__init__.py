"""Touching points with a tip: joints alone, read from the pendant, give tool tips, user frames and checks."""

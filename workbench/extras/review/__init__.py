"""Recordings looked at again: in the rerun viewer, or replayed with all numbers."""

"""Recordings looked at again: in the rerun viewer, two compared, replayed with all numbers, as a report."""

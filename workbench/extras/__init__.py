"""Extras: each folder has a record of its parts, listed in `workbench/parts.py`, as anybody's package has."""

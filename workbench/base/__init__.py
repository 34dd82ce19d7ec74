"""Foundations: errors, types, units, rigid motions, files."""

"""Plates as tables and JSON."""

"""Measurements: the table of rows, its readers, its observations, and simulated instruments."""

"""Measurements: the table of rows, readers, observations, simulated instruments, live sources."""

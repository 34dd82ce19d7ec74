"""Simulated arms and instruments."""

"""Plates of several sizes and ways to make them, weighed against each other."""

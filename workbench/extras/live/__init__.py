"""Guided measurement in a terminal, from a live source, and a virtual arm in place of one."""

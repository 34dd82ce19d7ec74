"""Guided measurement from a live source, and a virtual arm in place of one."""

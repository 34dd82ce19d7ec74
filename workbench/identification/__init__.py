"""Identification: one problem for all arms and observations, one file per algorithm."""

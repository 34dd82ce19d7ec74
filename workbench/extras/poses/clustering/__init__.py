"""Workspace clustering: poses with equal O in different cubes of a region (ARIA §4.2)."""

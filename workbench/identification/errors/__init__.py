"""Errors by row, of the arm as its file holds it, and to be expected elsewhere."""

"""Validation: errors on rows that took no part in the fit, and what they mean for the user."""

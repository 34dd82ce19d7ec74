"""Verification of a calibrated arm on fresh poses, with a certificate."""

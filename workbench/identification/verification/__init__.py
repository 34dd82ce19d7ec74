"""Verification: fresh poses judge a calibrated arm, and a certificate says so."""

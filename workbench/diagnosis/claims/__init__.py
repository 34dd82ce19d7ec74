"""What may be said of the effects that were found: causes with odds, and why they are not certain."""

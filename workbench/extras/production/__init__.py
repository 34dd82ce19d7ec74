"""Many arms on one plate: its yield, and plates of several sizes and ways to make them, compared."""

"""Many virtual arms on one plate: its yield."""

"""The identification algorithms, one file each."""

"""The plate optimiser: blocks, constraints, candidates, search."""

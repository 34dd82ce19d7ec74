"""What stands in the scene: one file per thing, each drawn from snapshots."""

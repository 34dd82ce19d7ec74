"""The objects in the scene, one file each, drawn from snapshots."""

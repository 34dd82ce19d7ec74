"""Design of experiments: fixture plates, the region that matters, observability, poses, branches."""

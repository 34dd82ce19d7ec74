"""Design of experiments: fixture plates, the region that matters, observability, choice of poses and branches."""

"""Live sources: samples from a real or simulated arm become stored rows."""

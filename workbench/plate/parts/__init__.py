"""Manufacturing a plate: its parts as solids and drawings, and the plate as measured afterwards."""

"""Making a plate: its parts as solids and drawings, and the plate as it was measured after making."""

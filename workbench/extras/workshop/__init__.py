"""What a workshop takes beside STL, DXF and lists: PDF, 3MF, STEP, inspection; a plate as measured."""

"""What a workshop takes beside STL and lists: drawings, 3MF, STEP, inspection; a plate as measured."""

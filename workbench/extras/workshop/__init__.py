"""What a workshop makes a plate from: solids, a drawing, the list of targets; a plate as measured."""

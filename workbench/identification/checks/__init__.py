"""Whether measurements are of this arm, and what went wrong where they seem not to be."""

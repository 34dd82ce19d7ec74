"""One's own robot: a table or a description read so that it gives the poses of the pendant."""

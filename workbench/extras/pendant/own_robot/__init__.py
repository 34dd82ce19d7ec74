"""One's own robot: signs, offsets, units and convention of a table, found by poses of the pendant."""

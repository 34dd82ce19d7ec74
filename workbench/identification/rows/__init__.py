"""Which rows are fitted, held out, or excluded."""

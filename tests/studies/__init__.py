"""The two works that this package grew from, done again: printed numbers beside what comes out here."""

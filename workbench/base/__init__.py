"""What everything stands on: errors, types, units, rigid motions, files."""

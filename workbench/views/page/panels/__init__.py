"""The panels, one class per file: each builds its controls once, shows snapshots, and only sends commands."""

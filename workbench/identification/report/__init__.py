"""An identification as tables, figures, HTML and JSON."""

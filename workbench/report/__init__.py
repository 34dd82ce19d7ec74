"""Building blocks of all reports: SVG drawings, formatted numbers, templates."""

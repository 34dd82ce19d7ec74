"""A diagnosis as tables, pictures, HTML and JSON."""

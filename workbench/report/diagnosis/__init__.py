"""A diagnosis for people and for scripts: tables, pictures, a page, plain data."""

"""Reports of results: tables for the terminal, figures, JSON, and an HTML page that needs no network."""

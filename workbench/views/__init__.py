"""Views of a session: the page in the browser and recordings."""

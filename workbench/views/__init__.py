"""The views of a session: what is drawn, in the browser and in recordings."""

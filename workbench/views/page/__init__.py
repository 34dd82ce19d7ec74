"""The browser view: a secured local viser server, a scene, and panels that only send commands."""

"""The browser view: a hardened local viser server, a scene, and panels that only send commands."""

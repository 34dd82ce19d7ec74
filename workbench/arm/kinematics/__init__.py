"""Poses of the tool and the links, and their derivatives in the constants."""

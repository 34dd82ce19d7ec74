"""Cameras with boards or tags: the printed board as an instrument.

`camera.py` projects, `target.py` holds the board or tags, `rig.py` both; `pixel_table.py` makes a `Dataset`
of the corners that were found.
"""

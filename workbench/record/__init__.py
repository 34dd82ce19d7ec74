"""The session as a recording for the rerun viewer, and everything that is made of recordings.

A recorder follows the session beside the journal and draws it; the journal stays the truth, from which the
pictures can be drawn again. What is drawn where is said in `entities/`, one file per kind of thing; how the
viewer is laid out in `blueprint.py`. Only the modules that draw import rerun, which is an extra.
"""

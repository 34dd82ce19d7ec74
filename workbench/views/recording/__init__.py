"""Recordings of sessions for the rerun viewer, and everything made from recordings.

A recorder follows the session beside the journal and draws it; the journal stays the truth, from which the
pictures can be drawn again. The layout of the viewer, the same for all steps, is in `contents.py`.

| path | what |
|---|---|
| `world/…` | the scene, as on the page: `views/drawables/`; `world/eye`: the camera that looks at it |
| `title`, `about` | what is seen, and how to read it |
| `result` | the diagnosis, or the identified parameters |
| `bars/…` | index O of each target, or errors of the rows |
| `log` | the log of commands |
| `index/…`, `predicted/…`, `error/…` | over the steps: indices, errors predicted, left and diagnosed |
"""

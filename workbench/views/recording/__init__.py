"""Recordings of sessions for the rerun viewer, and everything made from recordings.

A recorder follows the session beside the journal and draws it; the journal stays the truth, from which the
pictures can be drawn again. The layout of the viewer is in `blueprint.py`.

| path | what |
|---|---|
| `world/…` | the scene, as on the page: `views/drawables/` |
| `about`, `parameters`, `figure/…`, `target/index_O` | words, tables, pictures, index O of each target |
| `diagnosis/words` | the diagnosis: verdict, effects |
| `log` | the log of commands |
| `index/…`, `predicted/…`, `error/…` | over the steps: indices, errors predicted, left and diagnosed |
"""

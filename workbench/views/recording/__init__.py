"""The session as a recording for the rerun viewer, and everything that is made of recordings.

A recorder follows the session beside the journal and draws it; the journal stays the truth, from which the
pictures can be drawn again. How the viewer is laid out is said in `blueprint.py`.

| path | what |
|---|---|
| `world/…` | the scene, as on the page: `views/drawables/` |
| `about`, `parameters`, `figure/…`, `target/index_O` | words, tables, pictures, index O of each target |
| `diagnosis/words`, `…/ranking` | what the model lacked: verdict, effects, candidates |
| `log` | what was done |
| `index/…`, `predicted/…`, `error/…` | over the steps: indices, errors predicted, left and diagnosed |
| `row_error/…` | errors over the measured rows, by identification and fit |
| `world/plate/trails/N` | where dragged targets have been |
| `searches` | what the searches of whole plates came to |
"""

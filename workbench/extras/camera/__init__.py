"""Cameras with boards or tags: the printed board as an instrument.

`camera.py` projects, `target.py` holds the board or tags, `rig.py` both; `pixel_table.py` makes a `Dataset`
of the corners that were found. `pose_pairs.py`, `pair_fit.py` and `hand_eye.py` need no picture.
"""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "board": "workbench.extras.camera.commands:board",
        "handeye": "workbench.extras.camera.commands:handeye",
    },
    root={
        "HandEye": "workbench.extras.camera.hand_eye:HandEye",
        "handeye": "workbench.extras.camera.hand_eye:handeye",
        "read_pixels": "workbench.extras.camera.pixel_table:read_pixels",
        "read_rig": "workbench.extras.camera.rig:read_rig",
    },
    observations=("workbench.extras.camera.observation:PixelObservation",),
    preparations=("workbench.extras.camera.preparation:PicturePreparation",),
    sources=("workbench.extras.camera.commands:PixelSource",),
    session_commands=("workbench.extras.camera.session_commands:LoadPictures",),
    panels=("workbench.extras.camera.panels:CamerasPanel",),
)

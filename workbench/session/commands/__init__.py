"""Commands: everything that can be asked of a session, one file per subject."""

from workbench.session.commands.compare import SetOverlay, ShowFit, ShowRow
from workbench.session.commands.data import ForgetData, LoadData, MeasureVirtualArm
from workbench.session.commands.fit import Identify
from workbench.session.commands.messages import Dismiss, Tell
from workbench.session.commands.noise import SetNoise
from workbench.session.commands.targets import (
    DropTarget,
    GrabTarget,
    MoveTarget,
    Redo,
    ResetTargets,
    SelectTarget,
    Undo,
)

__all__ = [
    "Dismiss",
    "DropTarget",
    "ForgetData",
    "GrabTarget",
    "Identify",
    "LoadData",
    "MeasureVirtualArm",
    "MoveTarget",
    "Redo",
    "ResetTargets",
    "SelectTarget",
    "SetNoise",
    "SetOverlay",
    "ShowFit",
    "ShowRow",
    "Tell",
    "Undo",
]

"""Commands: everything that can be asked of a session, one file per subject."""

from workbench.session.commands.arm import (
    ChooseRobot,
    Jog,
    JogTo,
    LoadModel,
)
from workbench.session.commands.arrange import (
    ApplyPattern,
    PlaceTargets,
    Snap,
    SnapTarget,
)
from workbench.session.commands.branches import ChooseBranch, MixBranches
from workbench.session.commands.capture import CapturePose, ForgetPoses
from workbench.session.commands.choices import HoldParameter, LeaveRowsOut
from workbench.session.commands.compare import (
    SetDark,
    SetOverlay,
    SetUnits,
    ShowFit,
    ShowRow,
)
from workbench.session.commands.data import ForgetData, LoadData, MeasureVirtualArm
from workbench.session.commands.diagnose import AddEffects, Diagnose, TakeNextPoses
from workbench.session.commands.drag import (
    DropTarget,
    GrabTarget,
    MoveTarget,
    SelectTarget,
)
from workbench.session.commands.edit import (
    AddTarget,
    CopyTarget,
    DeleteTarget,
    LockTarget,
    RenumberTarget,
)
from workbench.session.commands.fit import Identify
from workbench.session.commands.measure import (
    BeginMeasuring,
    DriveArm,
    EndMeasuring,
    NextWanted,
    StoreRow,
    TakeAgain,
    TakeSample,
    UseRows,
)
from workbench.session.commands.messages import Dismiss, SetCaption, Tell
from workbench.session.commands.noise import SetNoise
from workbench.session.commands.production import TryPlate
from workbench.session.commands.region import (
    MapCubes,
    SampleRegion,
    SetRegion,
    ShowCubes,
)
from workbench.session.commands.search import ClusterTargets, ImprovePlate
from workbench.session.commands.source import FollowSource, MeasureLive, TellSource
from workbench.session.commands.track import (
    LeaveTrack,
    PauseTrack,
    PlaceTrack,
    PlanTrack,
    PlayTrack,
    SetPace,
)
from workbench.session.commands.undo import (
    Redo,
    ResetTargets,
    RestoreBest,
    Undo,
)

CHORES = (SampleRegion, MapCubes)
"""What sessions work out by themselves."""

AUTOMATIC = (PlaceTrack, TakeSample, TellSource)
"""What no user asks for: it does not show that somebody has gone on and read the news."""

__all__ = [
    "AUTOMATIC",
    "CHORES",
    "AddEffects",
    "AddTarget",
    "ApplyPattern",
    "BeginMeasuring",
    "CapturePose",
    "ChooseBranch",
    "ChooseRobot",
    "ClusterTargets",
    "CopyTarget",
    "DeleteTarget",
    "Diagnose",
    "Dismiss",
    "DriveArm",
    "DropTarget",
    "EndMeasuring",
    "FollowSource",
    "ForgetData",
    "ForgetPoses",
    "GrabTarget",
    "HoldParameter",
    "Identify",
    "ImprovePlate",
    "Jog",
    "JogTo",
    "LeaveRowsOut",
    "LeaveTrack",
    "LoadData",
    "LoadModel",
    "LockTarget",
    "MapCubes",
    "MeasureLive",
    "MeasureVirtualArm",
    "MixBranches",
    "MoveTarget",
    "NextWanted",
    "PauseTrack",
    "PlaceTargets",
    "PlaceTrack",
    "PlanTrack",
    "PlayTrack",
    "Redo",
    "RenumberTarget",
    "ResetTargets",
    "RestoreBest",
    "SampleRegion",
    "SelectTarget",
    "SetCaption",
    "SetDark",
    "SetNoise",
    "SetOverlay",
    "SetPace",
    "SetRegion",
    "SetUnits",
    "ShowCubes",
    "ShowFit",
    "ShowRow",
    "Snap",
    "SnapTarget",
    "StoreRow",
    "TakeAgain",
    "TakeNextPoses",
    "TakeSample",
    "Tell",
    "TellSource",
    "TryPlate",
    "Undo",
    "UseRows",
]

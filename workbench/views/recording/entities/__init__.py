"""What a recording shows: one file per kind of thing, one line here.

| path | what |
|---|---|
| `world/arm/nominal`, `world/arm/calibrated` | the arms, a body each |
| `world/plate/solid`, `…/targets/N`, `…/trails/N` | fixture, targets, the ways of dragged targets |
| `world/region/outline`, `…/cubes` | the region that matters and its cube field |
| `world/track/wanted`, `…/reached` | the planned trajectory, and where the tool goes |
| `world/measured`, `world/errors/nominal`, `…/calibrated` | measured positions, exaggerated errors |
| `index/…`, `predicted/…`, `error/…` | over the steps: indices, errors predicted, left and diagnosed |
| `row_error/…` | errors over the measured rows, by identification and fit |
| `target/index_O` | index O of each target |
| `diagnosis/words`, `…/ranking` | what the model lacked: verdict, effects, candidates |
| `searches` | what the searches of whole plates came to |
| `log`, `about`, `parameters`, `figure/…` | words, tables, pictures |
"""

from workbench.views.recording.entities.arm import Arms, ArmsAtRows
from workbench.views.recording.entities.diagnosis import Diagnosed
from workbench.views.recording.entities.entity import AbstractEntity, Moment
from workbench.views.recording.entities.figures import Figures
from workbench.views.recording.entities.measured import Measured
from workbench.views.recording.entities.plate import PlateSolid, Targets, Trails
from workbench.views.recording.entities.region import Cubes, RegionOutline
from workbench.views.recording.entities.searches import Searches
from workbench.views.recording.entities.series import RowErrors, Series, TargetBars
from workbench.views.recording.entities.track import Trajectory
from workbench.views.recording.entities.words import About, Log, Parameters

ENTITIES: tuple[type[AbstractEntity], ...] = (
    About,
    Log,
    Arms,
    PlateSolid,
    Targets,
    Trails,
    RegionOutline,
    Cubes,
    Trajectory,
    Measured,
    Series,
    RowErrors,
    TargetBars,
    Parameters,
    Figures,
    Diagnosed,
    Searches,
)
"""Everything that is drawn, in this order."""

AT_ROWS: tuple[type[AbstractEntity], ...] = (
    About,
    ArmsAtRows,
    PlateSolid,
    Targets,
    RegionOutline,
    Measured,
    Parameters,
)
"""What the timeline of the measured rows shows, as it was when the rows came or were fitted."""

__all__ = ["AT_ROWS", "ENTITIES", "AbstractEntity", "Moment"]

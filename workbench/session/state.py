"""The session state: plain frozen data that views draw and commands replace.

Nothing here computes. Parts that no command touches stay the same objects: views see by identity what is new.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.linearisation import Linearisation
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.data.accuracy_requirement import Wanted
from workbench.diagnosis.result import Diagnosis
from workbench.identification.problem_blocks import Noise
from workbench.identification.result import Identification
from workbench.identification.run import Run
from workbench.plate.cube_map import CubeMap
from workbench.plate.plate import Plate
from workbench.plate.plate_score import SetScore
from workbench.plate.region import Region
from workbench.session.comparison import Comparison, Overlay
from workbench.session.live_score import PlateTrial
from workbench.session.loaded_measurements import Loaded, MeasurementFile
from workbench.session.page_state import MESSAGES, PASSING, Message, PageState, Severity
from workbench.session.part import AbstractPart, GoesWith, Part
from workbench.session.target_postures import TargetState

UNDO_STEPS, WHOLE = 200, 12
"""How many moves can be taken back, and how many times another robot, rows, results or exclusions."""


class Focus(StrEnum):
    """What sets the posture of the arm in the scene: a target, a measured row, or jogging."""

    TARGET = "target"
    ROW = "row"
    JOG = "jog"


NO_FIELD, PREDICTED_ERROR = "none", "predicted"
"""Names of the fields of cubes that a session begins with; the others are in `cube_fields.py`."""


@dataclass(frozen=True)
class Drag:
    """Which browser drags which target, and what all told before; nobody else can move any meanwhile."""

    client: int
    target: int
    begun: Linearisation | None = field(default=None, compare=False)


@dataclass(frozen=True, eq=False)
class UndoStep:
    """Targets before or after a move, for undo.

    Args:
        plate: The plate.
        states: How the arm stands at its targets.
        score: What they told then.
        session: The whole session, without its own steps, where the robot or what was found is another.
        by: Title of the command that led away from it, once it has.
    """

    plate: Plate
    states: tuple[TargetState, ...]
    score: SetScore
    session: "Session | None" = None
    by: str = ""

    @classmethod
    def of(cls, session: "Session", *, is_whole: bool = False) -> "UndoStep":
        """The targets of a session, without the matrices of their score, which are ten times the rest."""
        small = replace(session.score, linearisation=None, arm=None)
        whole = replace(session, drag=None).updated("history", done=(), undone=()) if is_whole else None
        return cls(session.plate, session.states, small, whole)


@dataclass(frozen=True, kw_only=True)
class CubeView:
    """How the cubes of the region are shown.

    Args:
        field: Name of what colours them (`cube_fields.py`).
        cut: Axis that is cut across: 0, 1, 2, or None for all layers.
        layer: Which layer across that axis is kept, counted from 0.
        is_chosen: Whether a user chose this; else it gives way to measured rows.
    """

    field: str = NO_FIELD
    cut: int | None = None
    layer: int = 0
    is_chosen: bool = True


FIRST_VIEW = CubeView(field=PREDICTED_ERROR, cut=1, is_chosen=False)
"""An upright cut through the middle of the region."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlateHistory:
    """What the plate was before: to undo, to compare with, and to go back to.

    Args:
        first: The fixture as it was loaded.
        done: Steps that undo goes back to, oldest first.
        undone: Steps that redo goes forward to, nearest last.
        past: The targets after every step, oldest first.
        best: Those with the smallest predicted error so far.
        searched: The plate that the last search for a better one ended with.
    """

    first: UndoStep
    done: tuple[UndoStep, ...] = ()
    undone: tuple[UndoStep, ...] = ()
    past: tuple[UndoStep, ...] = ()
    best: UndoStep | None = None
    searched: Plate | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class EvaluationRegion:
    """The region of the plate, in which its error is predicted.

    Args:
        q: Joint positions of poses in it [rad or m].
        sampled: The region that they were drawn from; another one than the plate's: work is under way.
        cubes: What is known of its cubes, once worked out.
        view: How they are shown.
    """

    q: Float[np.ndarray, "poses n"]
    sampled: Region | None = None
    cubes: CubeMap | None = None
    view: CubeView = FIRST_VIEW


@dataclass(frozen=True, eq=False, kw_only=True)
class Playback:
    """What the arm in the scene stands at.

    Args:
        jogged: Joint positions of the jogged arm [rad or m]; None: it was not jogged.
    """

    focus: Focus = Focus.TARGET
    jogged: Float[np.ndarray, " n"] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurements:
    """What was measured, and what the user says of it.

    Args:
        unread: A file whose columns can't be read as they are understood, until another one is.
        levelled: Whether the z axis of the measuring frame is vertical, as the user says.
        left_out: Measured rows that the user keeps out, counted as in the data.
    """

    loaded: Loaded | None = None
    unread: MeasurementFile | None = None
    levelled: bool = False
    left_out: frozenset[int] = frozenset()

    def row_name(self, row: int) -> str:
        """How people call a row, as its file does."""
        return f"{row}" if self.loaded is None else self.loaded.row_name(row)

    def named(self, sentence: str) -> str:
        """A sentence with rows as people call them."""
        return sentence if self.loaded is None else self.loaded.named(sentence)


@dataclass(frozen=True, eq=False, kw_only=True)
class Results:
    """What was found from the measurements.

    Args:
        asked: The command that identified.
        accepted: Effects that were added to the model, as the diagnosis found them.
        geometry: The fit without them, on the same rows, if there was one; else the diagnosis has its own.
        fit: Name of the algorithm whose robot is shown.
        comparison: Measured against predicted, row by row, once there are measurements.
        row: Measured row that is looked at.
    """

    identification: Identification | None = None
    asked: Any = None
    diagnosis: Diagnosis | None = None
    accepted: tuple[AbstractEffect, ...] = ()
    geometry: Run | None = None
    fit: str = ""
    comparison: Comparison | None = None
    row: int = 0

    @property
    def run(self) -> Run | None:
        return None if self.identification is None else self.identification.runs[self.fit]

    @property
    def is_empty(self) -> bool:
        """Whether nothing has been found."""
        return self.identification is None and self.diagnosis is None

    @property
    def calibrated(self) -> Robot | None:
        return None if self.run is None else self.run.calibrated


@dataclass(frozen=True, eq=False, kw_only=True)
class Choices:
    """What the user wants of this arm, whatever is measured and on whatever plate.

    Args:
        wanted: Errors that the calibrated arm has to keep; None: nothing is judged.
        overlay: What is laid over the scene.
    """

    wanted: Wanted | None = None
    overlay: Overlay = field(default_factory=Overlay)


@dataclass(frozen=True, eq=False, kw_only=True)
class Session:
    """The complete state at one moment: the arm on a plate, and records that outlast another plate or arm.

    Args:
        plate: Fixture with its targets as they stand now.
        is_plate_given: Whether the plate is the user's: it and its region then stay.
        states: How the arm stands at every target.
        score: What the targets would tell about the robot.
        parts: What extras keep, by type; see `part`.
    """

    robot: Robot
    plate: Plate
    is_plate_given: bool = False
    states: tuple[TargetState, ...]
    score: SetScore
    noise: Noise = field(default_factory=Noise)
    selected: int = 0
    drag: Drag | None = None
    region: EvaluationRegion
    history: PlateHistory
    playback: Playback = Playback()
    measurements: Measurements = field(default_factory=Measurements)
    results: Results = field(default_factory=Results)
    choices: Choices = field(default_factory=Choices)
    page: PageState = field(default_factory=PageState)
    parts: Mapping[type[AbstractPart], AbstractPart] = field(default_factory=dict)

    def updated(self, record: str, **changes: Any) -> "Session":
        """The session with some fields of one of its records replaced: `updated("results", fit="ols")`."""
        return replace(self, **{record: replace(getattr(self, record), **changes)})

    def part(self, kind: type[Part]) -> Part | None:
        """What an extra keeps under this type; None if nothing."""
        found = self.parts.get(kind)
        return found if isinstance(found, kind) else None

    def with_part(self, part: AbstractPart) -> "Session":
        return replace(self, parts={**self.parts, type(part): part})

    def with_parts(self, *of: GoesWith) -> "Session":
        """The session with those parts alone that go with one of these."""
        kept = {k: p for k, p in self.parts.items() if k.goes_with in of}
        return self if len(kept) == len(self.parts) else replace(self, parts=kept)

    def without_part(self, kind: type[AbstractPart]) -> "Session":
        kept = {k: p for k, p in self.parts.items() if k is not kind}
        return self if len(kept) == len(self.parts) else replace(self, parts=kept)

    @property
    def mode(self) -> AbstractPart | None:
        """The part whose own the page is at present."""
        return next((part for part in self.parts.values() if part.is_mode), None)

    @property
    def tried(self) -> PlateTrial | None:
        """The trial of the current plate, if there was one."""
        trial, now = self.part(PlateTrial), (self.plate, self.noise, self.choices.wanted)
        return trial if trial and (trial.plate, trial.noise, trial.wanted) == now else None

    @property
    def shows_plate(self) -> bool:
        """Whether the plate is in the scene: not while rows of another are looked at."""
        return self._are_on_plate or self.playback.focus is not Focus.ROW

    @property
    def seen_rows(self) -> Comparison | None:
        """The rows that are in the scene: none while a plate is looked at that they aren't of."""
        is_seen = self._are_on_plate or self.playback.focus is not Focus.TARGET
        return self.results.comparison if is_seen and self.choices.overlay.points else None

    @property
    def _are_on_plate(self) -> bool:
        """Whether rows, if there are any, may be of this plate, as the user's, or a virtual arm's."""
        loaded = self.measurements.loaded
        return loaded is None or loaded.virtual or self.is_plate_given

    @property
    def is_idle(self) -> bool:
        return self.page.job is None

    def check_target(self, number: int) -> None:
        if not 0 <= number < len(self.plate):
            raise OptionError(f"target must be 1 to {len(self.plate)}, got {number + 1}")

    def with_message(self, severity: Severity, text: str, *, refused: str = "") -> "Session":
        number, older = self.page.message_count + 1, list(self.page.messages)
        if len(older) >= MESSAGES:  # what passes goes before what is wrong, the oldest first
            older.remove(min(older, key=lambda m: m.severity not in PASSING))
        messages = (*older, Message(number, severity, text, refused))
        return self.updated("page", messages=messages, message_count=number)

    def without_messages(self, is_over: Callable[[Message], bool]) -> "Session":
        """The session without some of its messages."""
        kept = tuple(m for m in self.page.messages if not is_over(m))
        same = len(kept) == len(self.page.messages)
        return self if same else self.updated("page", messages=kept)

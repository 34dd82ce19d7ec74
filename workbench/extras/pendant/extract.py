"""The model that a controller computes with, from poses that it shows.

A controller reports the pose of its own, often calibrated, model: an instrument whose only noise is rounding.
The model is found when what is left is no more than that.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import final

import numpy as np
from scipy import special

from workbench.arm.calibration_record import Expected
from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.arguments import Like, checked_arguments
from workbench.base.threads import one_thread
from workbench.base.types import Freedom
from workbench.base.wording import in_mm, listed, plural
from workbench.data.arguments import RobotLike
from workbench.data.dataset import Dataset
from workbench.extras.pendant.convention import as_datasets, reading_of_display, with_displayed_frames
from workbench.extras.pendant.displayed import Displayed, DisplayMeaning, read_display
from workbench.identification.identify import identify
from workbench.identification.meaning.reading import RowReading
from workbench.identification.meaning.usable_rows import MIN_ROWS
from workbench.identification.report.document import errors_table
from workbench.identification.report.results_json import identification_json, reading_json, validation_json
from workbench.identification.result import Identification
from workbench.report.blocks import Block, headed, lines
from workbench.report.json import Json, document
from workbench.report.result_display import AbstractShown

SCHEMA = "workbench.extraction/1"
ROUNDING, CHANCE = 1.5, 1e-3
"""Root mean square of what is left, in standard deviations of rounding, that a model may leave; where few
numbers are to spare, as much as chance leaves once in so many files."""
UNCERTAIN = (0.3, 2e-4)
"""Expected error from which on readings are too few: share of what the model explains, and minimum [m]."""
NEGLIGIBLE = np.repeat([1e-5, 4e-5], 3)
"""Standard deviation of rounding [m], [rad] below which what is left is not worth a word: with all digits,
joints and pose of real controllers, read one after the other, differ by 3 to 20 µm."""


class ModelVerdict(StrEnum):
    """What the controller computes with."""

    NOMINAL = "nominal"
    EXTRACTED = "extracted"
    OTHER = "another arm"
    UNCERTAIN = "too few readings"
    MORE = "more than geometry"


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Extraction(AbstractShown):
    """A controller's model.

    Args:
        robot: The controller's arm, in the frame that it displays and with the tool that is set.
        meaning: What the displayed numbers mean.
        left: Root mean square of nominal and extracted arm's errors, in standard deviations of rounding.
        allowed: How much a model may leave.
        notes: What else was decided, one sentence each.
    """

    robot: Robot
    meaning: DisplayMeaning
    run: Identification
    left: tuple[float, float]
    allowed: float
    notes: tuple[str, ...] = ()

    @cached_property
    def verdict(self) -> ModelVerdict:
        if self.left[1] > self.allowed:
            return ModelVerdict.MORE
        if self.run.sister:
            return ModelVerdict.OTHER
        share, minimum = UNCERTAIN
        before, after = (each.train.position_mm.rms for each in (self.run.nominal, self.run.best))
        explained = 1e-3 * np.sqrt(max(before**2 - after**2, 0.0))
        if self.expected.position > max(share * explained, minimum):
            return ModelVerdict.UNCERTAIN
        return ModelVerdict.NOMINAL if self.left[0] < self.allowed else ModelVerdict.EXTRACTED

    @cached_property
    def expected(self) -> Expected:
        """Error of the extracted model over all postures within the joint limits [m], [rad]."""
        return self.run.best.transfer.anywhere

    @property
    def sentence(self) -> str:
        nominal, after = (1e-3 * e.train.position_mm.mean for e in (self.run.nominal, self.run.best))
        if self.verdict is ModelVerdict.OTHER:
            return self.run.sister
        if self.verdict is ModelVerdict.NOMINAL:
            return f"your controller is nominal: this arm agrees with it to {in_mm(nominal)} on average"
        if self.verdict is ModelVerdict.MORE:
            return (
                "your controller compensates more than geometry, such as sag, or joints and pose were not "
                f"read at once: geometry leaves {in_mm(after)}, {self.left[1]:.1f} times the rounding; write "
                "the readings with --rows and use 'workbench diagnose'"
            )
        size = f"{in_mm(self.expected.position)} and {max(np.rad2deg(self.expected.rotation), 1e-4):.2g}°"
        if self.verdict is ModelVerdict.UNCERTAIN:
            return (
                f"{plural(len(self.run.data), 'reading')} leave the model uncertain by {size}; read more, "
                "with all digits and every joint moved ('workbench poses --number 30' chooses some)"
            )
        aside = ", with the base and tool below" if self.run.frames.base or self.run.frames.tool else ""
        return (
            f"your controller is calibrated: {in_mm(nominal)} from the nominal model on average{aside}; the "
            f"extracted model is expected to be off by {size} (root mean square over all postures)"
        )

    @property
    def frames(self) -> tuple[str, ...]:
        """What the display refers to, one sentence each."""
        own, at, said = self.run.frames, self.robot, (*self.meaning.assumptions, *self.meaning.changes)
        tool = f"a tool is set: {_pose_text(at.tool)}" if own.tool else "no tool is set: it shows the flange"
        base = f"a user frame is set: the robot's base is at {_pose_text(at.base)}" if own.base else ""
        found = [f"the display: {', '.join(said)}", tool, base]
        return tuple(filter(None, found[: 1 if self.verdict is ModelVerdict.OTHER else 3]))

    def blocks(self) -> list[Block]:
        table = errors_table([("nominal", self.run.nominal), ("extracted", self.run.best)])
        off = [f"reading {o.row + 1} {o.text.partition(' ')[2]}" for o in self.run.outliers]
        warning = [f"left out, as not fitting the others: {listed(off)}: correct or read again"] * bool(off)
        sentence = f"{self.run.nominal_robot.name}: {self.sentence}"
        return headed(sentence, table, *lines("found", self.frames + self.notes), *lines("warning", warning))

    def json(self) -> Json:
        """The result as plain data, with the identification under its own schema."""
        is_set = {"tool_set": bool(self.run.frames.tool), "base_set": bool(self.run.frames.base)}
        return document(
            SCHEMA,
            robot=self.run.nominal_robot.name,
            **reading_json(self.run.data, self.run.nominal_robot),
            verdict=self.verdict,
            message=self.sentence,
            display=self.meaning._asdict() | is_set,
            nominal=validation_json(self.run.nominal),
            extracted=validation_json(self.run.best),
            left={"nominal": self.left[0], "extracted": self.left[1]},
            expected={"position_m": self.expected.position, "rotation_rad": self.expected.rotation},
            outliers=[o.row for o in self.run.outliers],
            identification=identification_json(self.run),
        )


@checked_arguments()
@one_thread()
def extract(
    robot: RobotLike,
    readings: Path | Like[Dataset] | Sequence[str],
    *,
    columns: str | None = None,
    reading: str = "auto",
) -> Extraction:
    """Find the model that a controller computes with from joints and poses that its pendant shows.

    Args:
        robot: The maker's nominal arm.
        readings: A table, a log or bag with joints and poses, typed poses `q1,…,qn = x,y,z,a,b,c`, or rows.
        columns: Of the file, as of `read_measurements`.
        reading: What is accepted of joints and units that headings say otherwise, as of `identify`.

    Raises:
        DataError: too few readings, none that this arm can show, or several meanings that fit.
        FileError, OptionError: no readings.
    """
    shown = read_display(readings, robot, columns=columns)
    meant = reading_of_display(robot, shown, reading)
    found = _extracted(robot, shown, meant, np.arange(len(shown.data)))
    stood = np.flatnonzero(shown.stood)
    if found.verdict is not ModelVerdict.MORE or len(stood) < MIN_ROWS:
        return found
    alone, moved = _extracted(robot, shown, meant, stood), plural(len(shown.data) - len(stood), "reading")
    note = f"{moved} left out, as the arm moved: joints and pose were not read at once"
    return found if alone.verdict is ModelVerdict.MORE else replace(alone, notes=(note,))


def _extracted(robot: Robot, shown: Displayed, reading: RowReading, rows: np.ndarray) -> Extraction:
    arm = reading.on(robot.bare) or robot
    data, rounded = (each.take(rows) for each in as_datasets(arm, robot, shown, reading))
    run, nominal, best, allowed = _fitted(framed := with_displayed_frames(arm, reading), data)
    if best > allowed and (np.asarray(rounded.sigma) > np.asarray(data.sigma)).any():
        run, nominal, best, allowed = _fitted(framed, rounded)  # whole degrees that were not commanded
    return Extraction(
        robot=run.aligned if nominal < allowed else run.best.calibrated,
        meaning=shown.meaning(reading),
        run=run,
        left=(nominal, best),
        allowed=allowed,
    )


def _fitted(arm: Robot, data: Dataset, set_apart: bool = True) -> tuple[Identification, float, float, float]:
    """The model that fits, what the nominal arm and it leave, root mean square in standard deviations of
    rounding, and how much a model may leave."""
    run = identify(arm, data, set_apart=set_apart, held_out=0.0, reading="given")
    if run.outliers and set_apart and (every := _fitted(arm, data, set_apart=False))[2] <= every[3]:
        return every  # all agree within their last digits
    used, spare = run.data.take(run.train_rows), max(6 * len(run.train_rows) - run.best.fit.factor.rank, 1)
    shown, sizes = se3.pose(*map(np.asarray, (used.rotation, used.position))), np.asarray(used.sigma)
    arms = (each.predict(used.q) for each in (run.aligned, run.best.calibrated))
    errors = np.array([se3.pose_error(shown, own) / np.maximum(sizes, NEGLIGIBLE) for own in arms])
    nominal, best = np.sqrt((errors**2).mean((1, 2))).tolist()
    allowed = max(ROUNDING, float(np.sqrt(special.chdtri(spare, CHANCE) / spare)))
    found = run, nominal, best * float(np.sqrt(6 * len(used) / spare)), allowed
    may_be_bare = (
        run.frames.base and arm.base.free is Freedom.AUTO
    )  # as the arm's own lengths may be the frame
    bare = _fitted(arm.with_frames(base=Frame()), data, set_apart) if may_be_bare else found
    return bare if bare[2] <= bare[3] else found


def _pose_text(frame: Frame) -> str:
    xyz = ", ".join(f"{1e3 * v:.2f}" for v in frame.xyz)
    rpy = ", ".join(f"{v:.3f}" for v in np.rad2deg(frame.rpy))
    return f"x, y, z {xyz} mm, roll, pitch, yaw {rpy}°".replace("-", "−")

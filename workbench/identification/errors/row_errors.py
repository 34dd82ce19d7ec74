"""Position and orientation errors of a model on measured rows, and their summary.

Errors and residuals row by row as data frames, fitted rows before held-out ones.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, final

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.calibration_record import Expected
from workbench.arm.robot import Robot
from workbench.base.frames import data_frame
from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observation import Channel, OwnErrors
from workbench.data.prediction import predict, row_components
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import Noise, Problem
from workbench.identification.problem_blocks import observations, of_rows

if TYPE_CHECKING:
    from pandas import DataFrame

KINDS = {
    "position_mm": ("position", 1e3, " mm"),
    "orientation_deg": ("rotation", float(np.rad2deg(1.0)), "°"),
    "tilt_deg": ("tilt", float(np.rad2deg(1.0)), "°"),
}
"""Kinds of errors by the name of their summary: field of `Errors` row by row, factor and unit of that."""
TOOL = "position_mm", "orientation_deg"
"""Those of the tool."""
AXES = ("x[m]", "y[m]", "z[m]", "rx[rad]", "ry[rad]", "rz[rad]")


class Spread(NamedTuple):
    """Mean, root mean square, maximum and median of some errors; the median is insensitive to a few wrong
    rows.

    All are NaN where nothing was measured.
    """

    mean: float
    rms: float
    max: float
    median: float

    @classmethod
    def of(cls, errors: Float[np.ndarray, " rows"]) -> "Spread":
        """Summary of one error per row; unmeasured ones (NaN) are ignored."""
        errors = errors[np.isfinite(errors)]
        if not len(errors):
            return NOTHING
        rms = float(np.sqrt((errors**2).mean()))
        return cls(float(errors.mean()), rms, float(errors.max()), float(quantile(errors, 0.5)))


NOTHING = Spread(*[float("nan")] * 4)
"""Summary of no errors."""


def quantile(values: Float[np.ndarray, "n ..."], share: float) -> Any:
    """Quantile of finite numbers along the first axis: numpy's takes far longer for few of them."""
    place = share * (len(values) - 1)
    middle = [int(place), int(np.ceil(place))]
    low, high = np.partition(values, middle, axis=0)[middle]
    return low + (place - middle[0]) * (high - low)


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors row by row, and their summary by kind; false without rows.

    Args:
        position: Distance between measured and predicted point [m]; of several markers their rms; NaN where
            no position was measured.
        rotation: Angle between measured and predicted orientation of the tool [rad]; NaN without one.
        tilt: Angle error of a link's inclinometer [rad], the rms of several; NaN without.
        own: Errors of readings in their own unit; position and rotation are then the expected errors at the
            tool. None without such readings.
    """

    position: Float[np.ndarray, " rows"]
    rotation: Float[np.ndarray, " rows"]
    tilt: Float[np.ndarray, " rows"]
    own: OwnErrors | None = None

    def __len__(self) -> int:
        return len(self.position)

    def take(self, rows: np.ndarray) -> "Errors":
        own = None if self.own is None else OwnErrors(self.own.name, *(v[rows] for v in self.own[1:]))
        return Errors(self.position[rows], self.rotation[rows], self.tilt[rows], own)

    def widened(self, position: float, rotation: float) -> "Errors":
        """The same with the model's own uncertainty at the tool [m], [rad] added in quadrature."""
        wider = np.hypot(self.position, position), np.hypot(self.rotation, rotation)
        return replace(self, position=wider[0], rotation=wider[1])

    @cached_property
    def spreads(self) -> dict[str, Spread]:
        """Summaries of what was measured, by name with its unit: those of `KINDS`, then of readings in their
        own unit, such as `pixel_px`, with the rms of all readings."""
        found = {name: Spread.of(factor * getattr(self, rows)) for name, (rows, factor, _) in KINDS.items()}
        if (seen := self.own) is not None:
            square = np.nansum(seen.number * seen.size**2) / max(np.nansum(seen.number), 1.0)
            name = seen.name.replace("[", "_").rstrip("]")
            found[name] = Spread.of(seen.size)._replace(rms=float(np.sqrt(square)))
        return {name: spread for name, spread in found.items() if np.isfinite(spread.mean)}

    @property
    def position_mm(self) -> Spread:
        """Of positions [mm]; NaN for data without."""
        return self.spreads.get("position_mm", NOTHING)

    @property
    def orientation_deg(self) -> Spread | None:
        """Of the tool's orientations [deg]; None for data without."""
        return self.spreads.get("orientation_deg")

    @property
    def main(self) -> Spread:
        """Of positions [mm]; where none were measured of orientations or tilts [deg], or of readings."""
        return next(iter(self.spreads.values()), NOTHING)

    @property
    def expected(self) -> Expected:
        """Mean errors [m], [rad]; NaN where not measured."""
        turned = self.spreads.get("orientation_deg", NOTHING).mean
        return Expected(1e-3 * self.position_mm.mean, float(np.deg2rad(turned)))

    def text(self, which: str) -> str:
        """Mean, median … of positions and orientations, for display; empty if neither was measured."""
        found = [(name, spread) for name, spread in self.spreads.items() if name in TOOL]
        return ", ".join(f"{getattr(spread, which):.3g}{KINDS[name][2]}" for name, spread in found)


@dataclass(frozen=True, eq=False)
class AbstractValidation:
    """What errors of one model have: on the rows that were fitted, and on those that were not.

    Args:
        train: Errors on the rows that were fitted, in the order of `Identification.train_rows`.
        held_out: Likewise on the held-out rows.
    """

    train: Errors
    held_out: Errors

    @property
    def judged(self) -> Errors:
        """Errors on the held-out rows; on the fitted ones if there are none."""
        return self.held_out or self.train

    def without(self, suspects: Bool[np.ndarray, " held"]) -> Errors:
        """Errors on the other held-out rows; on the fitted ones if there are none."""
        return self.held_out.take(~suspects) or self.train


@final
@dataclass(frozen=True, eq=False)
class Validation(AbstractValidation):
    """Errors of one model."""


SUSPICIOUS_SHARE_OF_NOMINAL = 0.7
SUSPICIOUS_SHARE_OF_REACH, SUSPICIOUS_FLOOR = 0.01, 1e-3
"""A fit explains little if its error exceeds the first share of the nominal arm's, or the second one of the
reach, and is not below a floor [m] that any arm of this kind may leave …"""
SUSPICIOUS_TURN, TURN_FLOOR = 3.0, 1.0
"""… or, of orientations beside positions, these angles [deg]."""


def explains_little(nominal: Errors, found: Errors, reach: float) -> bool:
    """Whether a model leaves so much of the nominal arm's errors that robot, units or frames may be wrong.

        r > max(min(0.7 r_nominal, 0.01 L), 1 mm),      r root mean squares, L the reach

    Where no positions were measured, lengths are angles at the reach. Orientations beside positions are
    judged likewise, between 1° and 3°.
    """
    has_positions = np.isfinite(nominal.position_mm.mean)
    unit = 1e3 if has_positions else float(np.rad2deg(1.0)) / reach
    limit = min(SUSPICIOUS_SHARE_OF_NOMINAL * nominal.main.rms, unit * SUSPICIOUS_SHARE_OF_REACH * reach)
    if found.main.rms > max(limit, unit * SUSPICIOUS_FLOOR):
        return True
    before, after = (errors.spreads.get("orientation_deg", NOTHING).rms for errors in (nominal, found))
    limit = max(min(SUSPICIOUS_SHARE_OF_NOMINAL * before, SUSPICIOUS_TURN), TURN_FLOOR)
    return bool(has_positions and np.isfinite(before) and after > limit)


MAX_SHARE_OF_REACH, MAX_TURN = 0.01, 3.0
"""Mean errors beyond this share of the reach, or this angle [deg], are of no calibrated arm."""
CHANCE, NEGLIGIBLE = 0.5, 1e-6
"""A channel is worse if its mean rises by more than this over the root of the number of rows, as it may by
chance where the nominal arm is exact; errors below the second [mm or deg] are none."""


def why_unusable(found: Errors, nominal: Errors, reach: float) -> str:
    """Why a model should not be used, as the end of a sentence; empty if it may.

    It is off further than any calibrated arm of this reach [m], or worse than nominal on the same rows.
    """
    if found.own is not None:
        return ""  # readings in a unit of their own decide themselves what may be identified
    for name, spread in found.spreads.items():
        after, unit = spread.mean, KINDS[name][2]
        limit = 1e3 * MAX_SHARE_OF_REACH * reach if name == "position_mm" else MAX_TURN
        if after > limit:
            return f"off by {after:.3g}{unit} on average, more than any calibrated arm ({limit:.3g}{unit})"
    for name, spread in found.spreads.items():
        before, after, unit = nominal.spreads.get(name, NOTHING).mean, spread.mean, KINDS[name][2]
        if after > (1.0 + CHANCE / np.sqrt(len(nominal))) * before + NEGLIGIBLE:
            return f"worse than nominal: {after:.4g}{unit} on average, nominal {before:.4g}{unit}"
    return ""


UNKNOWN = Errors(*np.zeros((3, 0)))
"""Errors of no rows, or that could not be computed."""


def row_errors(robot: Robot, data: Dataset, *, known: Mapping[str, float] | None = None) -> Errors:
    """Errors of a model, nothing fitted.

    Args:
        robot: The model, with its frames per session where it has them.
        known: Places of anchors, contacts or markers [m]; unknown ones are fitted to the rows.
    """
    robot.check_joints(data.q, data.source)
    places = instrument_places(robot, data, known=known)
    own: OwnErrors | None = None
    square, components = np.zeros((2, 3, len(data)))  # of positions, of the tool's rotations, of tilts
    for observation, rows in observations(data):
        poses = predict(robot, of_rows(data, rows), link=observation.link)
        unknown = np.array([places[name] for name in observation.unknowns], float)
        at = observation.linearise(poses, unknown)
        if (found := observation.own_errors(at)) is not None:
            table = np.full((4, len(data)), np.nan)
            table[:, rows] = found[1:]
            own = OwnErrors(found.name, *map(frozen, table))
            continue
        seen = np.broadcast_to(observation.seen, at.residual.shape)
        turns = np.array([c in (Channel.ROTATION, Channel.TILT) for c in observation.channels], bool)
        measured = np.where(seen, at.residual, 0.0) ** 2
        for kind, mine in ((0, ~turns), (1 if observation.link is None else 2, turns)):
            square[kind, rows] += measured[:, mine].sum(1)
            components[kind, rows] += seen[:, mine].sum(1)
    vectors = np.maximum(components / np.array([[3.0], [np.inf], [2.0]]), 1.0)  # markers, inclinometers
    errors = np.where(components > 0.0, np.sqrt(square / vectors), np.nan)
    if own is not None:
        errors[:2] = np.where(np.isnan(errors[:2]), [own.position, own.rotation], errors[:2])
    position, rotation, tilt = map(frozen, errors)
    return Errors(position, rotation, tilt, own)


def together(fitted: Dataset, others: Dataset) -> tuple[Dataset, list[np.ndarray]] | None:
    """Rows beside the fitted ones, and which are whose; None where each tells its error alone: pictures of
    one rig tell a tool's error only together."""
    readings = None if fitted.readings is None else fitted.readings.joined(others.readings)
    if readings is None:
        return None
    both = replace(fitted, readings=None).joined(replace(others, readings=None))
    return replace(both, readings=readings), np.split(np.arange(len(both)), [len(fitted)])


def count_measured(data: Dataset) -> int:
    """Number of measured components; hidden markers have none."""
    return sum(
        int(np.broadcast_to(observation.seen, (len(rows), len(observation.channels))).sum())
        for observation, rows in observations(data)
    )


def instrument_places(
    robot: Robot, data: Dataset, *, known: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Places of anchors, contacts or markers [m]: known ones as given, the others fitted for this model."""
    known = dict(known or {})
    if all(name in known for observation, _ in observations(data) for name in observation.unknowns):
        return known
    alike = None if data.readings is None else Noise(0.0, 0.0)
    problem = Problem.build(robot, data, free=(), known=known, noise=alike)
    found = Opt2(limit=60).search(problem).x
    return known | problem.named(found)


def residuals_frame(robot: Robot, fitted: Dataset, held_out: Dataset | None = None) -> "DataFrame":
    """Measured − predicted by row number, axis by axis in the measuring frame; NaN where not measured."""
    parts = [fitted] if held_out is None else [fitted, held_out]
    columns: dict[str, np.ndarray] = {"row": np.concatenate([part.row for part in parts])}
    if held_out is not None:
        columns["held_out"] = np.repeat([False, True], [len(fitted), len(held_out)])
    found = [row_components(robot, part) for part in parts]
    values = np.vstack([np.hstack([errors.position, errors.rotation]) for errors in found])
    return data_frame({**columns, **dict(zip(AXES, values.T, strict=True))}, index="row")

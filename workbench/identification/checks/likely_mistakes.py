"""Mistakes in a file that make an arm's own rows look foreign: joints exchanged or inverted, units, axes.

The rows are corrected for each possible mistake and aligned with the arm in closed form; the best candidates
are refined. A mistake is reported only if it explains the rows far better than any other.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from jaxtyping import Float

from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict
from workbench.identification.alignment import align, starts
from workbench.identification.frames import visible_parts
from workbench.identification.problem import FrameFreedom

FRAME_STEPS = 10
"""Refinement steps after the closed forms, which leave small errors if arm and rows belong together."""
MIN_ERROR_RATIO = 5.0
"""A mistake must reduce the error by this factor, …"""
MIN_RIVAL_RATIO = 2.0
"""… and leave this many times less than any other explanation."""
MIN_SIGN_RATIO = 1.2
"""Factor by which inverting a joint must reduce the error; below it, its sign is unobservable."""
MAX_REFINED, MAX_LIKELY = 6, 3
"""Number of candidates that are refined, and maximum number reported if they explain the rows equally
well."""
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254}


@dataclass(frozen=True, eq=False)
class CorrectedRows:
    """Rows after correction of a mistake.

    Args:
        text: The mistake.
        data: The corrected rows.
        inverted: Joints that it inverts.
        headings: Correct heading by given heading; empty where no heading corrects it.
        shrunk: Factor by which the correction shrinks the points or the arm's motion, and with them the
            error.
        error: Remaining error [m].
    """

    text: str
    data: Dataset
    inverted: frozenset[int] = frozenset()
    headings: Mapping[str, str] = field(default_factory=dict)
    shrunk: float = 1.0
    error: float = np.inf

    @property
    def cost(self) -> float:
        """Remaining error at the scale of the file [m]; small motions would otherwise have small errors."""
        return self.error * self.shrunk


def explained(robot: Robot, data: Dataset, error: float, *, maximum: float) -> CorrectedRows | None:
    """The mistake that explains the misfit, or two or three equally likely ones; None if nothing does.

    Args:
        robot: Nominal arm without effects.
        data: A few dozen rows with measured points, of one session.
        error: Their error without correction [m].
        maximum: Maximum error of rows that belong to the arm [m].
    """
    rough = [replace(r, error=rough_error(robot, r.data)) for r in _readings(robot, data)]
    nearest = sorted(rough, key=lambda r: r.cost)[:MAX_REFINED]
    close = [replace(r, error=median_error(aligned(robot, r.data, FRAME_STEPS), r.data)) for r in nearest]
    found = sorted(
        (r for r in close if r.error < maximum and r.cost < error / MIN_ERROR_RATIO), key=lambda r: r.cost
    )
    alike = [r for r in found if r.cost < MIN_RIVAL_RATIO * found[0].cost]
    likely = [r for r in alike if not any(_is_part(other, r) for other in alike)]
    if not 0 < len(likely) <= MAX_LIKELY:
        return None
    headings = likely[0].headings if len(likely) == 1 else {}
    return replace(likely[0], text=", or ".join(r.text for r in likely), headings=headings)


def _is_part(one: CorrectedRows, other: CorrectedRows) -> bool:
    """Whether a candidate inverts a subset of another's joints and explains as much."""
    return bool(one.inverted) and one.inverted < other.inverted and one.error < MIN_SIGN_RATIO * other.error


def aligned(robot: Robot, data: Dataset, limit: int = 100) -> Robot:
    """The arm with the base and tool that fit rows best."""
    return align(robot, data, FrameFreedom(*visible_parts(data)), limit=limit)


def rough_error(robot: Robot, data: Dataset) -> float:
    """Error after aligning base and tool in closed form [m]."""
    return min(median_error(at, data) for at in starts(robot, data, FrameFreedom(*visible_parts(data))))


def median_error(robot: Robot, data: Dataset) -> float:
    """Median distance of measured from predicted points [m]."""
    return float(np.median(distances(robot, data)))


def distances(robot: Robot, data: Dataset) -> Float[np.ndarray, " rows"]:
    """Of measured from predicted points [m]."""
    assert data.position is not None
    return np.linalg.norm(predict(robot, data)[:, :3, 3] - data.position, axis=1)


def _readings(robot: Robot, data: Dataset) -> Iterator[CorrectedRows]:
    """The rows corrected for each of the usual mistakes."""
    yield from _joints_read_otherwise(robot, data)
    yield from _points_read_otherwise(robot, data)


def _joints_read_otherwise(robot: Robot, data: Dataset) -> Iterator[CorrectedRows]:
    n, slides = data.joints, sliding(robot)
    for i, j in combinations(range(n), 2):
        if slides[i] == slides[j]:
            order = np.arange(n)
            order[[i, j]] = j, i
            yield _in_order(f"q{i + 1} and q{j + 1} look exchanged", data, order)
    for order, how in ((np.arange(n)[::-1], "reversed"), (np.roll(np.arange(n), 1), "shifted by one"),
                         (np.roll(np.arange(n), -1), "shifted by one")):  # fmt: skip
        if n > 2 and (slides[order] == slides).all():
            yield _in_order(f"the order of the joints looks {how}", data, order)
    for joints in (*combinations(range(n), 1), *combinations(range(n), 2)):
        signs = np.where(np.isin(np.arange(n), joints), -1.0, 1.0)
        names = " and ".join(f"q{k + 1}" for k in joints)
        how = f"{names} {'seems' if len(joints) == 1 else 'seem'} to have the opposite sign"
        yield CorrectedRows(how, replace(data, q=data.q * signs), frozenset(joints))
    degree = np.pi / 180.0
    turning = (("deg", "degrees labelled rad", degree), ("rad", "rad labelled degrees", 1.0 / degree))
    for scaled, who, guesses in (
        (~slides, "the joints", turning),
        (slides, "the prismatic joints", tuple(_units())),
    ):
        for unit, how, factor in guesses if scaled.any() else ():
            q = data.q * np.where(scaled, factor, 1.0)
            headings = {f"q{k + 1}": f"q{k + 1}[{unit}]" for k in np.flatnonzero(scaled)}
            text, shrunk = f"{who} look like {how}", max(1.0, 1.0 / factor)
            yield CorrectedRows(text, replace(data, q=q), headings=headings, shrunk=shrunk)


def _in_order(text: str, data: Dataset, order: np.ndarray) -> CorrectedRows:
    headings = {f"q{was + 1}": f"q{k + 1}" for k, was in enumerate(order) if was != k}
    return CorrectedRows(text, replace(data, q=data.q[:, order]), headings=headings)


def _points_read_otherwise(robot: Robot, data: Dataset) -> Iterator[CorrectedRows]:
    points = np.asarray(data.position)
    for unit, text, factor in _units():
        yield CorrectedRows(
            f"the positions look like {text}",
            replace(data, position=points * factor),
            headings={axis: f"{axis}[{unit}]" for axis in "xyz"},
            shrunk=max(1.0, 1.0 / factor),
        )
    if data.rotation is None:
        mirrored = replace(data, position=points * [1.0, 1.0, -1.0])
        yield CorrectedRows("two of x, y, z look exchanged, or one has the opposite sign", mirrored)
        return
    for k, name in enumerate("xyz"):
        signs = np.where(np.arange(3) == k, -1.0, 1.0)
        yield CorrectedRows(f"{name} seems to have the opposite sign", replace(data, position=points * signs))
    for i, j in combinations(range(3), 2):
        order = np.arange(3)
        order[[i, j]] = j, i
        one, other = "xyz"[i], "xyz"[j]
        exchanged, headings = replace(data, position=points[:, order]), {one: other, other: one}
        yield CorrectedRows(f"{one} and {other} look exchanged", exchanged, headings=headings)


def _units() -> Iterator[tuple[str, str, float]]:
    """Units that are easily confused: the right one, text, and the correction factor."""
    for own, size in LENGTHS.items():
        for label, taken in LENGTHS.items():
            if own != label:
                yield own.replace("inch", "in"), f"{own} labelled {label}", size / taken

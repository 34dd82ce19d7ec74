"""Mistakes in a file that make an arm's own rows look foreign: joints exchanged or inverted, units, axes.

Each reading that takes one such mistake back is aligned with the arm by closed forms; those that leave least
are refined. A mistake is named only if it explains the rows far better than anything else.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict
from workbench.identification.alignment import align, starts
from workbench.identification.frames import visible_parts
from workbench.identification.problem import FrameFreedom

FRAME_STEPS = 10
"""Steps to the frames from closed forms, which leave little where arm and rows belong together."""
BETTER = 5.0
"""What explains rows leaves so many times less than they have as they are, …"""
ALONE = 2.0
"""… and so many times less than any other explanation."""
NO_GAIN = 1.2
"""Joints whose sign is not seen improve nothing by this."""
REFINED, MAX_LIKELY = 6, 3
"""Readings that are looked at closely, and that are named where they explain the rows alike."""
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254}


@dataclass(frozen=True, eq=False)
class CorrectedRows:
    """Rows as they would be without a mistake.

    Args:
        text: The mistake.
        rows: The rows with it taken back.
        inverted: Joints that it inverts.
        headings: What the columns are without it, by what they are called; empty where no heading tells it.
        shrunk: How many times it shrinks the points, or the motion of the arm, and with them the error.
        error: What is left of the rows [m].
    """

    text: str
    rows: Dataset
    inverted: frozenset[int] = frozenset()
    headings: Mapping[str, str] = field(default_factory=dict)
    shrunk: float = 1.0
    error: float = np.inf

    @property
    def cost(self) -> float:
        """What is left, in the size of the file [m]: an arm at rest hardly misses points at rest."""
        return self.error * self.shrunk


def explained(robot: Robot, seen: Dataset, error: float, *, maximum: float) -> CorrectedRows | None:
    """The mistake that explains why rows miss their arm, or two or three that do alike; None if nothing does.

    Args:
        robot: Nominal arm without effects.
        seen: A few dozen rows with measured points, of one session.
        error: What they leave as they are [m].
        maximum: What an arm's own rows leave at most [m].
    """
    rough = [replace(r, error=rough_error(robot, r.rows)) for r in _readings(robot, seen)]
    nearest = sorted(rough, key=lambda r: r.cost)[:REFINED]
    close = [replace(r, error=median_error(aligned(robot, r.rows, FRAME_STEPS), r.rows)) for r in nearest]
    found = sorted((r for r in close if r.error < maximum and r.cost < error / BETTER), key=lambda r: r.cost)
    alike = [r for r in found if r.cost < ALONE * found[0].cost]
    likely = [r for r in alike if not any(_is_part(other, r) for other in alike)]
    if not 0 < len(likely) <= MAX_LIKELY:
        return None
    headings = likely[0].headings if len(likely) == 1 else {}
    return replace(likely[0], text=", or ".join(r.text for r in likely), headings=headings)


def _is_part(one: CorrectedRows, other: CorrectedRows) -> bool:
    """Whether a reading inverts some of another's joints and explains as much."""
    return bool(one.inverted) and one.inverted < other.inverted and one.error < NO_GAIN * other.error


def aligned(robot: Robot, seen: Dataset, limit: int = 100) -> Robot:
    """The arm with the base and tool that fit rows best."""
    return align(robot, seen, FrameFreedom(*visible_parts(seen)), limit=limit)


def rough_error(robot: Robot, seen: Dataset) -> float:
    """What the closed forms of base and tool leave [m]."""
    return min(median_error(at, seen) for at in starts(robot, seen, FrameFreedom(*visible_parts(seen))))


def median_error(robot: Robot, seen: Dataset) -> float:
    """Median distance of measured from predicted points [m]."""
    assert seen.position is not None
    return float(np.median(np.linalg.norm(predict(robot, seen)[:, :3, 3] - seen.position, axis=1)))


def _readings(robot: Robot, seen: Dataset) -> Iterator[CorrectedRows]:
    """The rows without each of the usual mistakes."""
    yield from _joints_read_otherwise(robot, seen)
    yield from _points_read_otherwise(robot, seen)


def _joints_read_otherwise(robot: Robot, seen: Dataset) -> Iterator[CorrectedRows]:
    n, slides = seen.joints, sliding(robot)
    for i, j in combinations(range(n), 2):
        if slides[i] == slides[j]:
            order = np.arange(n)
            order[[i, j]] = j, i
            yield _in_order(f"q{i + 1} and q{j + 1} look exchanged", seen, order)
    for order, how in ((np.arange(n)[::-1], "reversed"), (np.roll(np.arange(n), 1), "shifted by one"),
                         (np.roll(np.arange(n), -1), "shifted by one")):  # fmt: skip
        if n > 2 and (slides[order] == slides).all():
            yield _in_order(f"the order of the joints looks {how}", seen, order)
    for joints in (*combinations(range(n), 1), *combinations(range(n), 2)):
        signs = np.where(np.isin(np.arange(n), joints), -1.0, 1.0)
        names = " and ".join(f"q{k + 1}" for k in joints)
        how = f"{names} {'seems' if len(joints) == 1 else 'seem'} to have the opposite sign"
        yield CorrectedRows(how, replace(seen, q=seen.q * signs), frozenset(joints))
    degree = np.pi / 180.0
    turning = (("deg", "degrees labelled rad", degree), ("rad", "rad labelled degrees", 1.0 / degree))
    for scaled, who, guesses in (
        (~slides, "the joints", turning),
        (slides, "the joints that slide", tuple(_units())),
    ):
        for unit, how, factor in guesses if scaled.any() else ():
            q = seen.q * np.where(scaled, factor, 1.0)
            headings = {f"q{k + 1}": f"q{k + 1}[{unit}]" for k in np.flatnonzero(scaled)}
            text, shrunk = f"{who} look like {how}", max(1.0, 1.0 / factor)
            yield CorrectedRows(text, replace(seen, q=q), headings=headings, shrunk=shrunk)


def _in_order(text: str, seen: Dataset, order: np.ndarray) -> CorrectedRows:
    headings = {f"q{was + 1}": f"q{k + 1}" for k, was in enumerate(order) if was != k}
    return CorrectedRows(text, replace(seen, q=seen.q[:, order]), headings=headings)


def _points_read_otherwise(robot: Robot, seen: Dataset) -> Iterator[CorrectedRows]:
    points = np.asarray(seen.position)
    for unit, text, factor in _units():
        yield CorrectedRows(
            f"the positions look like {text}",
            replace(seen, position=points * factor),
            headings={axis: f"{axis}[{unit}]" for axis in "xyz"},
            shrunk=max(1.0, 1.0 / factor),
        )
    if seen.rotation is None:
        mirrored = replace(seen, position=points * [1.0, 1.0, -1.0])
        yield CorrectedRows("two of x, y, z look exchanged, or one has the opposite sign", mirrored)
        return
    for k, name in enumerate("xyz"):
        signs = np.where(np.arange(3) == k, -1.0, 1.0)
        yield CorrectedRows(f"{name} seems to have the opposite sign", replace(seen, position=points * signs))
    for i, j in combinations(range(3), 2):
        order = np.arange(3)
        order[[i, j]] = j, i
        one, other = "xyz"[i], "xyz"[j]
        rows, headings = replace(seen, position=points[:, order]), {one: other, other: one}
        yield CorrectedRows(f"{one} and {other} look exchanged", rows, headings=headings)


def _units() -> Iterator[tuple[str, str, float]]:
    """Pairs of units that may be confused: the right one, words, and the factor that takes it back."""
    for own, size in LENGTHS.items():
        for label, taken in LENGTHS.items():
            if own != label:
                yield own.replace("inch", "in"), f"{own} labelled {label}", size / taken

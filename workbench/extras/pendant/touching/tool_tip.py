"""The tip of a tool from touching a point in several orientations (a pivot).

    R_i t + p_i = c_k,        i the touches of point k, (R_i, p_i) the flange, t the tip in it, c_k the point

is linear in t and c_k.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.arguments import Length, Like, checked_arguments
from workbench.base.errors import DataError
from workbench.base.wording import in_mm, plural
from workbench.data.arguments import RobotLike
from workbench.data.dataset import Dataset
from workbench.data.postures import repeats
from workbench.extras.pendant.touching import touches as shared
from workbench.report.blocks import Block
from workbench.report.json import Json
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown

SCHEMA = "workbench.tcp/1"
MIN_TOUCHES = 4
TILTED = 0.05
"""Minimum root mean square by which orientations differ along each axis of the flange [rad]."""
MIN_PART, LEAVES = 3, 0.5
"""Touches before or after a change of tool or point; part of the scatter that it leaves at most."""
WEAK, USABLE = 3.0, 1e-3
"""Ratio of the widest to the narrowest interval beyond which the orientations are called alike; half width
beyond which a tip should not be used, by default [m]."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ToolTip(AbstractShown):
    """A tool's tip.

    Args:
        of: Touches of a point and their errors.
        xyz: The tip in the flange [m].
        half: Half of the 95 % interval along each axis of the flange [m]; NaN along one that the arm can't
            tilt, where the tip is as in its file.
        wanted: Required half width [m].
        change: From which touch on tool or point were others; empty if they stayed.
    """

    of: shared.TouchErrors
    xyz: Float[np.ndarray, "3"]
    half: Float[np.ndarray, "3"]
    wanted: float | None
    change: str = ""

    @cached_property
    def robot(self) -> Robot:
        """The arm with this tip; the tool's axes stay."""
        return self.of.robot.with_frames(tool=Frame(self.xyz, self.of.robot.tool.rotation))

    @property
    def used(self) -> int:
        return len(self.of.touches) - len(self.of.slipped)

    @property
    def more(self) -> int:
        """How many more touches narrow the widest interval to the required one."""
        wider = np.nanmax(self.half) / (self.wanted or USABLE)
        return max(int(np.ceil(self.used * wider**2)) - self.used, 0)

    @property
    def doubt(self) -> str:
        """Why the tip should not be used as it is; empty if it may be."""
        if self.change:
            return self.change
        if self.of.scatter > shared.SCATTERED * self.of.robot.reach:
            return f"the touches disagree by {in_mm(self.of.scatter)}: choose the robot that touched"
        widest, wanted, known = float(np.nanmax(self.half)), self.wanted or USABLE, self._flange
        if widest <= wanted:
            how = f"± {in_mm(known)} only, not ± {in_mm(wanted)}; use the tip with this file only"
            return f"the flange itself is known to {how}" if self.wanted and known > wanted else ""
        remedy = f"add {max(self.more, 1)} touches in different orientations"
        if widest > WEAK * np.nanmin(self.half):
            remedy = "tilt the tool more between touches, about all axes"
        if self.of.robot.calibration is None:
            remedy = f"calibrate the arm first, or {remedy}"
        return f"the tip is known to ± {in_mm(widest)} only, not ± {in_mm(wanted)}; {remedy}"

    @property
    def _flange(self) -> float:
        """How well the model's flange is known [m]."""
        return 0.0 if (seen := self.of.robot.calibration) is None else seen.observed.flange.position

    @property
    def sentence(self) -> str:
        places = [*zip("xyz", 1e3 * self.xyz, 1e3 * self.half, strict=True)]
        parts = (f"{axis} {signed(value, 3)} ± {half:.3f}" for axis, value, half in places if half == half)
        still = (f"; {a} stays {signed(v, 3)} mm, as this arm can't tilt" for a, v, h in places if h != h)
        meet = f"{self.used} touches agree to {in_mm(self.of.scatter)} (rms)"
        known = (
            f"this model's flange, itself uncertain by {in_mm(self._flange)}: use the tip with this file only"
        )
        where = f"in {known}" if self._flange > np.nanmax(self.half) else "in the flange (95 %)"
        return f"tip at {', '.join(parts)} mm {where}; {meet}{''.join(still)}"

    def blocks(self) -> list[Block]:
        return self.of.blocks(self.sentence)

    def json(self) -> Json:
        said = self.doubt or self.sentence
        return self.of.json(SCHEMA, said, xyz=self.xyz, half_width=self.half, more=self.more)


@checked_arguments()
def tcp(
    robot: RobotLike,
    touches: shared.Touches,
    *,
    wanted: Like[Length] | None = None,
    columns: str | None = None,
) -> ToolTip:
    """Find a tool's tip from touching one point, or some, in four orientations or more, joints alone.

    Args:
        robot: The arm, calibrated or nominal; the tool in its file counts for nothing.
        touches: Joint positions; `contact` names which of several points was touched.
        wanted: Required half of the 95 % interval [m].
        columns: Of the file, as of `read_measurements`.

    Raises:
        DataError: too few touches of one point, or orientations that are too much alike.
        OptionError: a width that is not positive.
    """
    every = shared.read_touches(touches, robot, columns, wanted)
    given = every.take(np.sort(np.unique(repeats(every), return_index=True)[1]))
    again = [f"{plural(len(every) - len(given), 'row')} in the posture of another: one touch"]
    given = replace(given, notes=tuple(again[: len(every) - len(given)]))
    at, points, still = shared.flanges(robot, given.q), _points(given), _untilted(robot)
    for rows in (every, given):
        _check(rows, shared.flanges(robot, rows.q)[:, :3, :3].reshape(-1, 9), _points(rows), still)
    solve = lambda rows: _solve(at[rows], points[rows], still, robot.tool.xyz)  # noqa: E731
    change = _change(at, points, still, given.row)
    solved, slipped = shared.solve_without_slipped(solve, len(given), given.source)
    tips, kept = se3.apply(at, solved.x[:3]), np.delete(np.arange(len(at)), slipped)
    missed = tips - points @ np.linalg.lstsq(points[kept], tips[kept], rcond=None)[0]
    return ToolTip(
        of=shared.TouchErrors(robot, given, np.linalg.norm(missed, axis=1), slipped),
        xyz=solved.x[:3],
        half=np.where(still, np.nan, solved.half[:3]),
        wanted=wanted,
        change=change,
    )


def _points(touches: Dataset) -> Float[np.ndarray, "rows points"]:
    """Which point each touch is of."""
    names = np.array(shared.names_of(touches))
    return 1.0 * (names[:, None] == np.unique(names))


def _untilted(robot: Robot) -> Bool[np.ndarray, "3"]:
    """The axis of the flange about which alone an arm turns it, as a SCARA does."""
    low, high = robot.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (50, robot.dof))
    turns = shared.flanges(robot, q)[:, :3, :3]
    return np.asarray((turns - turns.mean(0)).std(0).max(0) < TILTED**2)


def _check(touches: Dataset, turns: np.ndarray, points: np.ndarray, still: Bool[np.ndarray, "3"]) -> None:
    count, names = points.shape
    if count - names < MIN_TOUCHES - 1:
        many = f" of {names} points (if these name the rows, remove their column)" if names > 1 else ""
        more = f"touch one point {MIN_TOUCHES} times or more, each time with another orientation of the tool"
        raise DataError(f"{touches.source}: {count} touches{many}; {more}")
    own, small = np.linalg.lstsq(points, turns, rcond=None)[0], np.rad2deg(np.abs(touches.q).max())
    _, sizes, axes = np.linalg.svd((turns - points @ own).reshape(-1, 3))
    how = "; tilt it by 30° or more about different axes"
    how += f", or head joints in rad q1[rad] … (all are within {small:.2g}°)" * bool(small < 2.0 * np.pi)
    minimum, why = TILTED * np.sqrt(count), "kept its orientation"
    if still.any() and sizes[-2] >= minimum:
        return
    if sizes[-1] < minimum <= sizes[-2]:
        axis = ", ".join(signed(v, 2) for v in axes[-1])
        why = f"was turned about one axis only, so the tip along ({axis}) of the flange can't be determined"
    if sizes[-1] < minimum:
        raise DataError(f"{touches.source}: the tool {why}{how}")


def _change(at: np.ndarray, points: np.ndarray, still: Bool[np.ndarray, "3"], row: np.ndarray) -> str:
    """From which touch on another tool, point, or both explain the touches far better; empty if none does."""
    solve = lambda *later: _solve(at, points, still, np.zeros(3), *later)  # noqa: E731
    whole, place, number = solve(), np.broadcast_to(np.eye(3), (len(at), 3, 3)), np.arange(len(at))
    tried = list[tuple[float, float, int, str, float]]()
    both = {"tool": (at[:, :3, :3] * ~still,), "point": (place,), "tool and point": (at[:, :3, :3], place)}
    least = {what: MIN_PART * len(columns) for what, columns in both.items()}
    tests = [(k, "", number == k) for k in number.tolist()]  # a single one slipped
    tests += [(k, w, number >= k) for k, *_ in tests for w, n in least.items() if n <= k <= len(at) - n]
    for k, what, mine in tests:
        more = solve(*(columns * mine[:, None, None] for columns in both.get(what, (place,))))
        if more.spare > 0:
            scatter = more.left @ more.left / more.spare
            tried.append((whole.chance(more), scatter, k, what, float(np.linalg.norm(more.x[-3:]))))
    chance, scatter, k, what, by = min(tried, default=(1.0, 0.0, 0, "", 0.0))
    if (
        not what
        or chance * max(len(tried), 1) > shared.CHANCE
        or scatter > LEAVES**2 * (whole.left @ whole.left) / whole.spare
    ):
        return ""
    how = ", or name the points in a column 'contact'" * (what == "point")
    where = f"touches from {row[k] + 1} on are of another {what}" + f" ({in_mm(by)} off)" * (
        len(both[what]) < 2
    )
    return f"{where}: give those before or after alone{how}"


def _solve(
    at: np.ndarray,
    points: np.ndarray,
    still: Bool[np.ndarray, "3"],
    given: Float[np.ndarray, "3"],
    *later: Float[np.ndarray, "rows 3 3"],
) -> shared.TouchSolution:
    """The tip in the flange, as given along a still axis, the points in the base, and later changes [m]."""
    places = -np.einsum("nk,ij->nikj", points[:, points.any(0)], np.eye(3)).reshape(len(at), 3, -1)
    flat = np.concatenate([at[:, :3, :3], places, *later], axis=2).reshape(3 * len(at), -1)
    held = np.pad(np.where(still, given, 0.0), (0, flat.shape[1] - 3))
    right = -at[:, :3, 3].ravel() - flat @ held
    flat[:, :3] *= ~still
    x = np.linalg.lstsq(flat, right, rcond=None)[0]
    return shared.TouchSolution(x + held, right - flat @ x, np.linalg.pinv(flat.T @ flat, hermitian=True))

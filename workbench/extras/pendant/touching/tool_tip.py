"""The tip of a tool from touching a point in several orientations (a pivot), its axes from two touches more.

    R_i t + p_i = c,        i the touches, (R_i, p_i) the flange, t the tip in it, c the point

is linear in t and c. With several points there are as many c. For the tool's axes the tip is moved straight
away from the point, so that the point lies on the tool's own axis, ahead of the tip: R_jᵀ (c − p_j) − t is
that axis.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import final

import numpy as np
from jaxtyping import Float
from rich.console import Group, RenderableType
from rich.text import Text

from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.extras.pendant.touching.touches import (
    SCATTERED,
    Touches,
    half_width,
    numbered,
    read_touches,
    slipped,
)
from workbench.plate.door import door
from workbench.report.json import Json, plain
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown
from workbench.report.tables import line, new_table

SCHEMA = "workbench.tcp/1"
MIN_TOUCHES = 4
TILTED = 0.05
"""Least root mean square by which orientations differ along each axis of the flange [rad]."""
WEAK = 3.0
"""Ratio of the widest to the narrowest interval from which on the orientations are called alike."""
USABLE = 1e-3
"""Half width beyond which a tip should not be used, where nothing is asked for [m]."""
NEAREST = 0.02
"""Least distance of the tip from the point in touches of the tool's axes [m]."""
AXIS = re.compile(r"([+-]?)([xyz])", re.IGNORECASE)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ToolTip(AbstractShown):
    """A tool's tip, and its axes where they were touched.

    Args:
        nominal: The arm as it was given.
        xyz: The tip in the flange [m].
        half: Half of the 95 % interval along each axis of the flange [m].
        rotation: The tool's axes in the flange; as the arm has them where none were touched.
        turned: Half of the 95 % interval of their angles [rad]; None where none were touched.
        errors: Distance of the tip from its point in every touch of one [m].
        apart: Touches that slipped, the worst first.
        pivots: Touches of a point, by their place among all.
        wanted: Half width that was asked for [m].
        notes: What else should be known, one sentence each.
    """

    nominal: Robot
    touches: Touches
    xyz: Float[np.ndarray, "3"]
    half: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    turned: float | None
    errors: Float[np.ndarray, " rows"]
    scatter: float
    apart: tuple[int, ...]
    pivots: tuple[int, ...]
    wanted: float | None
    notes: tuple[str, ...]

    @cached_property
    def robot(self) -> Robot:
        return self.nominal.with_frames(tool=Frame(self.xyz, self.rotation))

    @property
    def more(self) -> int:
        """How many touches more narrow the widest interval to what is asked for."""
        wanted = self.wanted or USABLE
        used = len(self.pivots) - len(self.apart)
        return max(int(np.ceil(used * (self.half.max() / wanted) ** 2)) - used, 0)

    @property
    def doubt(self) -> str:
        """Why the tip should not be used as it is; empty if it may be."""
        if self.scatter > SCATTERED * self.nominal.reach:
            return (
                f"the touches miss one another by {in_mm(self.scatter)}: choose the robot that touched, or "
                "name the points in a column 'contact'"
            )
        if self.half.max() > (self.wanted or USABLE):
            size = in_mm(self.wanted or USABLE)
            return f"the tip is known to ± {in_mm(float(self.half.max()))} only, not ± {size}; {self._remedy}"
        return ""

    @property
    def _remedy(self) -> str:
        if self.half.max() > WEAK * self.half.min():
            return "touch with the tool tilted more, about all axes"
        return f"add {max(self.more, 1)} touches in other orientations"

    @property
    def sentence(self) -> str:
        parts = (
            f"{axis} {signed(1e3 * v, 3)} ± {1e3 * h:.3f}"
            for axis, v, h in zip("xyz", self.xyz, self.half, strict=True)
        )
        return (
            f"tip at {', '.join(parts)} mm in the flange (95 %); "
            f"{len(self.pivots) - len(self.apart)} touches meet within {in_mm(self.scatter)}"
        )

    def summary(self) -> RenderableType:
        table = new_table("Touches", "touch", "of", "off by [mm]", "")
        for k, error in zip(self.pivots, self.errors, strict=True):
            cells = str(self.touches.rows[k] + 1), self.touches.names[k], f"{1e3 * error:.3f}"
            table.add_row(*cells, "slipped, left out" if k in self.apart else "")
        parts: list[RenderableType] = [Text(f"{self.nominal.name}: {self.sentence}", style="bold"), table]
        if self.turned is not None:
            parts.append(frame_lines("tool's axes", self.rotation, self.turned))
        if self.apart:
            parts.append(line("warning", f"{numbered(self.touches, self.apart)} slipped; left out"))
        return Group(*parts, *(line("note", text) for text in self.notes))

    def json(self) -> Json:
        """The result as plain data, in SI."""
        return plain(
            {
                "schema": SCHEMA,
                "robot": self.nominal.name,
                "message": self.doubt or self.sentence,
                "xyz": self.xyz,
                "half_width": self.half,
                "rpy": None if self.turned is None else se3.matrix_to_rpy(self.rotation),
                "rotation_half_width": self.turned,
                "scatter": self.scatter,
                "touches": [
                    {"row": self.touches.rows[k], "error": e, "slipped": k in self.apart}
                    for k, e in zip(self.pivots, self.errors, strict=True)
                ],
                "more": self.more,
                "notes": list(self.notes),
            }
        )


@door()
def tcp(robot: Robot, touches: Path | Dataset, *, wanted: float | None = None) -> ToolTip:
    """Find a tool's tip from touching one point in four orientations or more, joints alone.

    Args:
        robot: The arm, calibrated or nominal; the tool in its file counts for nothing.
        touches: Joint positions; `contact` names the point where there are several, and is `x`, `y` or `z`
            in touches of the tool's axes: the tip moved straight away, the point ahead of it on that axis.
        wanted: Half of the 95 % interval that is asked for [m].

    Raises:
        DataError: fewer than four touches, or orientations that are too much alike.
        OptionError: a width that is not positive.
    """
    if wanted is not None and not wanted > 0.0:
        raise OptionError(f"the wanted accuracy must be positive, got {wanted:g} m")
    given = read_touches(touches, robot)
    flanges = given.flanges(robot)
    pivots = [k for k, name in enumerate(given.names) if not AXIS.fullmatch(name)]
    names = [given.names[k] for k in pivots]
    rotations, places = flanges[pivots, :3, :3], flanges[pivots, :3, 3]
    _check(given, pivots, names, rotations)

    def square(rows: Sequence[int]) -> tuple[float, int]:
        x, left = _solve(rotations[list(rows)], places[list(rows)], [names[k] for k in rows])
        return float((left**2).sum()), 3 * len(rows) - len(x)

    kept, apart = slipped(square, len(pivots))
    x, left = _solve(rotations[kept], places[kept], [names[k] for k in kept])
    points = dict(zip(dict.fromkeys(names[k] for k in kept), x[3:].reshape(-1, 3), strict=True))
    found = rotations @ x[:3] + places
    errors = np.array([np.linalg.norm(p - points.get(n, np.nan)) for p, n in zip(found, names, strict=True)])
    spread = half_width(float((left**2).sum()), left.size - len(x))
    half = spread * np.sqrt(np.diag(_covariance(rotations[kept], [names[k] for k in kept])))
    rotation, turned, notes = _axes(given, flanges, x[:3], x[3:6], spread, robot)
    if robot.calibration is None:
        notes.append(
            "the arm is nominal: its own errors add, often 1 mm; a calibrated one gives a better tip"
        )
    return ToolTip(
        nominal=robot,
        touches=given,
        xyz=x[:3],
        half=half,
        rotation=rotation,
        turned=turned,
        errors=errors,
        scatter=float(np.sqrt((left**2).sum(1).mean())),
        apart=tuple(pivots[k] for k in apart),
        pivots=tuple(pivots),
        wanted=wanted,
        notes=tuple(notes),
    )


def _check(touches: Touches, pivots: list[int], names: list[str], rotations: np.ndarray) -> None:
    lonely = [name for name in dict.fromkeys(names) if names.count(name) < 2]
    if len(pivots) < MIN_TOUCHES or lonely:
        what = (
            f"point '{lonely[0]}' was touched once"
            if lonely and len(pivots) >= MIN_TOUCHES
            else f"{len(pivots)} touches"
        )
        raise DataError(
            f"{touches.source}: {what}; touch a point {MIN_TOUCHES} times or more, each time with "
            "another orientation of the tool"
        )
    weakest = np.linalg.svd(_centred(rotations, names))[1:]
    least = TILTED * np.sqrt(len(pivots))
    if weakest[0][-2] < least:
        raise DataError(
            f"{touches.source}: the tool kept its orientation; tilt it by 30° or more about different axes "
            "(and if the joints are in rad, head them q1[rad] …)"
        )
    if weakest[0][-1] < least:
        axis = ", ".join(signed(v, 2) for v in weakest[1][-1])
        raise DataError(
            f"{touches.source}: the tool was turned about one axis only, so the tip along ({axis}) of the "
            "flange can't be seen; tilt it by 30° or more about another axis"
        )


def _centred(rotations: np.ndarray, names: Sequence[str]) -> Float[np.ndarray, "rows 3"]:
    """Rotations less the mean of those at the same point: what the tip is seen by."""
    out = rotations.copy()
    for name in set(names):
        mine = np.array([n == name for n in names])
        out[mine] -= rotations[mine].mean(0)
    return out.reshape(-1, 3)


def _solve(rotations: np.ndarray, places: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """The tip and the points [m], and the residual of every touch."""
    order = list(dict.fromkeys(names))
    matrix = np.zeros((len(names), 3, 3 + 3 * len(order)))
    matrix[:, :, :3] = rotations
    for row, name in enumerate(names):
        column = 3 + 3 * order.index(name)
        matrix[row, :, column : column + 3] = -np.eye(3)
    flat = matrix.reshape(3 * len(names), -1)
    x = np.linalg.lstsq(flat, -places.ravel(), rcond=None)[0]
    return x, (flat @ x + places.ravel()).reshape(-1, 3)


def _covariance(rotations: np.ndarray, names: Sequence[str]) -> Float[np.ndarray, "3 3"]:
    """Covariance of the tip for touches of unit variance."""
    seen = _centred(rotations, names)
    return np.linalg.inv(seen.T @ seen)


def _axes(
    touches: Touches, flanges: np.ndarray, tip: np.ndarray, point: np.ndarray, spread: float, robot: Robot
) -> tuple[np.ndarray, float | None, list[str]]:
    """The tool's axes in the flange, how well they are known, and notes."""
    seen: dict[str, list[np.ndarray]] = {}
    for k, name in enumerate(touches.names):
        if not (found := AXIS.fullmatch(name)):
            continue
        ahead = flanges[k, :3, :3].T @ (point - flanges[k, :3, 3]) - tip
        if (distance := float(np.linalg.norm(ahead))) < NEAREST:
            raise DataError(
                f"{touches.source}: {numbered(touches, [k])} is {in_mm(distance)} from the point; move it "
                f"{1e3 * NEAREST:.0f} mm or more away along the tool's axis {name}"
            )
        seen.setdefault(found[2].lower(), []).append(-ahead if found[1] == "-" else ahead)
    if not seen:
        return robot.tool.rotation, None, []
    mean = {axis: np.mean(ahead, axis=0) for axis, ahead in seen.items()}
    first = next(axis for axis in "zxy" if axis in mean)
    own = robot.tool.rotation
    second = next((a for a in "xyz" if a in mean and a != first), None)
    other = second or next(a for a in "xyz" if a != first)
    about = mean[second] if second else own[:, "xyz".index(other)]
    rotation, apart = _squared(first, mean[first], other, about)
    notes = []
    if second is None:
        notes.append(f"only the tool's {first} was touched: about it the tool is as the robot's file has it")
    elif abs(apart - 0.5 * np.pi) > np.deg2rad(5.0):
        notes.append(
            f"{first} and {second} are {np.rad2deg(apart):.1f}° apart; {second} was squared to {first}"
        )
    shortest = min(float(np.linalg.norm(ahead)) for ahead in mean.values())
    return rotation, float(spread * np.sqrt(2.0) / shortest), notes


def _squared(first: str, along: np.ndarray, second: str, about: np.ndarray) -> tuple[np.ndarray, float]:
    """Axes of which one is along a direction and another near a second; and the angle between the two."""
    a = along / np.linalg.norm(along)
    b = about / np.linalg.norm(about)
    apart = float(np.arccos(np.clip(a @ b, -1.0, 1.0)))
    b = b - (a @ b) * a
    rotation = np.empty((3, 3))
    i, j = "xyz".index(first), "xyz".index(second)
    rotation[:, i], rotation[:, j] = a, b / np.linalg.norm(b)
    third = 3 - i - j
    turn = 1.0 if (j - i) % 3 == 1 else -1.0
    rotation[:, third] = turn * np.cross(rotation[:, i], rotation[:, j])
    return rotation, apart


def frame_lines(what: str, rotation: np.ndarray, half: float) -> Text:
    """An orientation as pendants take it."""
    rpy = np.rad2deg(se3.matrix_to_rpy(rotation))
    vector = se3.matrix_to_rotvec(rotation)
    words = (
        f"roll, pitch, yaw {', '.join(signed(v, 3) for v in rpy)}° (A, B, C the other way round); rotation "
        f"vector {', '.join(signed(v, 5) for v in vector)} rad"
    )
    known = f" ± {np.rad2deg(half):.2g}°" if np.isfinite(half) else ""
    return line(what, f"{words}{known}")

"""A user frame from touches: three points, 3-2-1 on the faces of a part, or the points of its drawing.

Every touch keeps some coordinates of the tip in the frame: all of a drawing's point, y and z of one on the x
axis, z of one on the plane. The frame is the least-squares solution of these,

    e · (T⁻¹ p_i − target_i) = 0,      e the axes that touch i keeps

by Gauss–Newton from a closed form, whichever of them were touched more often than they need to be.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np
import tomli_w
from jaxtyping import Bool, Float

from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.arguments import Length, Like, checked_arguments
from workbench.base.errors import DataError
from workbench.base.files import write_text
from workbench.base.wording import in_mm
from workbench.data.arguments import RobotLike
from workbench.data.dataset import Dataset
from workbench.data.readers.read import AS_HEADED, read_fields
from workbench.extras.pendant.touching import touches as shared
from workbench.report.blocks import Block, Sentence
from workbench.report.json import Json
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown

SCHEMA = "workbench.frame/1"
MAX_ROUNDS = 30
FLAT, MISREAD = 0.02, 10.0
"""Minimum extent of points across their line, as a share of that along it; and a ratio of sizes by less than
which a drawing and its touches differ."""
POOR = 1e-3
"""Root mean square of the touches' errors beyond which a frame should not be used, by default [m]."""
LABELS = (
    "name the touches in a column 'contact': origin, x, xy (three points), or plane, line, end (3-2-1: three "
    "on a face, two along an edge in the direction of x, one on the end), or as in --cad"
)
KEEPS = {"origin": "xyz", "x": "yz", "xy": "z", "plane": "z", "line": "y", "end": "x"}
"""Coordinates that a touch of each kind keeps."""

Begun = tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "rows 3"], Bool[np.ndarray, "rows 3"]]
"""A first frame in closed form, coordinates in it that the touches keep [m], and which of them count."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class UserFrame(AbstractShown):
    """A frame in the robot's base.

    Args:
        of: Touches and what each is off in the coordinates that it keeps.
        pose: Of the frame in the robot's base.
        half: Half of the 95 % intervals of position [m] and angles [rad] along the frame's axes; infinite
            where no touch is to spare.
        wanted: Required error of the touches [m].
    """

    of: shared.TouchErrors
    pose: Float[np.ndarray, "4 4"]
    half: Float[np.ndarray, "6"]
    wanted: float | None

    @property
    def doubt(self) -> str:
        """Why the frame should not be used as it is; empty if it may be."""
        limit = self.wanted or POOR
        if self.of.scatter > limit:
            what = "check the tool, the names of the points and the numbers of the drawing"
            return f"the touches miss the frame by {in_mm(self.of.scatter)}, more than {in_mm(limit)}: {what}"
        if self.wanted is not None and not np.isfinite(self.half[0]):
            return "there is no redundant touch to show the frame's error; touch one or two more points"
        return ""

    @property
    def sentence(self) -> str:
        each = zip("xyz", 1e3 * self.pose[:3, 3], 1e3 * self.half[:3], strict=True)
        parts = (f"{a} {signed(v, 3)}" + f" ± {h:.3f}" * bool(np.isfinite(h)) for a, v, h in each)
        off = f"touches are off by {in_mm(self.of.scatter)}"
        meet = off if np.isfinite(self.half[:3]).all() else "no redundant touch shows its error"
        return f"frame at {', '.join(parts)} mm in the robot's base; {meet}"

    @property
    def _table(self) -> dict[str, list[float]]:
        return {"xyz": self.pose[:3, 3].tolist(), "rpy": se3.matrix_to_rpy(self.pose[:3, :3]).tolist()}

    def save(self, path: Path | str) -> Path:
        """Write the frame as plates have them (.toml): `xyz` [m] and `rpy` [rad] in the robot's base."""
        return write_text(path, tomli_w.dumps({"frame": self._table}))

    def blocks(self) -> list[Block]:
        angles = ", ".join(signed(v, 3) for v in np.rad2deg(self._table["rpy"]))
        vector = ", ".join(signed(v, 5) for v in se3.matrix_to_rotvec(self.pose[:3, :3]))
        axes = f"roll, pitch, yaw {angles}° (A, B, C in reverse order); rotation vector {vector} rad"
        return self.of.blocks(self.sentence, Sentence(axes, "axes"))

    def json(self) -> Json:
        return self.of.json(SCHEMA, self.doubt or self.sentence, **self._table, half_width=self.half)


@checked_arguments()
def frame(
    robot: RobotLike,
    touches: shared.Touches,
    *,
    cad: Path | Mapping[str, Sequence[float]] | None = None,
    wanted: Like[Length] | None = None,
    columns: str | None = None,
) -> UserFrame:
    """Find a user frame in the robot's base from touches with a tool whose tip is known.

    Args:
        robot: The arm with its tool (`tcp`), calibrated or nominal.
        touches: Joint positions, and in `contact` what was touched: `origin`, `x`, `xy`; or `plane`, `line`,
            `end` for 3-2-1; or the names of the drawing's points.
        cad: The points of a drawing in its own frame [m]: by name, or a file with point, x[mm], y[mm], z[mm].
        wanted: Required error of the touches [m].
        columns: Of the file, as of `read_measurements`.

    Raises:
        DataError: no tool, too few touches, unknown names, or points on one line.
        OptionError: an accuracy out of range.
    """
    given = shared.read_touches(touches, robot, columns, wanted)
    if np.linalg.norm(robot.tool.xyz) < shared.EXACT_SCATTER:
        raise DataError(f"{robot.name} has no tool: find its tip with 'workbench tcp … --save'")
    at = tool_poses(robot.with_frames(base=Frame()), Motion(given.q))[:, :3, 3]
    known: Mapping[str, Any] = KEEPS if cad is None else _drawing(cad)
    if strange := [name for name in shared.names_of(given) if name not in known]:
        raise DataError(f"{given.source}: '{strange[0]}' is none of {', '.join(known)}; {LABELS}")
    begin, target, counts = _named(given, at, robot) if cad is None else _drawn(given, at, known)
    solved, slipped = shared.solve_without_slipped(
        lambda rows: _solve(begin, at[rows], target[rows], counts[rows].ravel()),
        len(given),
        f"{given.source}: the touches do not determine a frame; {LABELS}",
    )
    off = np.where(counts, se3.apply(se3.inverse(solved.x), at) - target, 0.0)
    return UserFrame(
        of=shared.TouchErrors(robot, given, np.linalg.norm(off, axis=1), slipped),
        pose=solved.x,
        half=solved.half,
        wanted=wanted,
    )


def _drawing(cad: Path | Mapping[str, Sequence[float]]) -> dict[str, np.ndarray]:
    """Points by name [m]."""
    if isinstance(cad, Mapping):
        return {str(name): np.asarray(place, float) for name, place in cad.items()}
    fields = read_fields(cad, columns=AS_HEADED).said
    xyz, names = fields.stacked(("x", "y", "z")), fields.values.get("point", fields.values.get("target"))
    if xyz is None or names is None:
        raise DataError(f"{cad}: give the columns point, x[mm], y[mm], z[mm]")
    return {str(name).strip(): place for name, place in zip(names, xyz, strict=True)}


def _drawn(touches: Dataset, tips: np.ndarray, points: Mapping[str, np.ndarray]) -> Begun:
    target = np.array([points[name] for name in shared.names_of(touches)])
    _require_spread(touches, target)
    drawn, touched = (float(np.linalg.norm(np.ptp(p, axis=0))) for p in (target, tips))
    if not 1.0 / MISREAD < drawn / max(touched, shared.EXACT_SCATTER) < MISREAD:
        both = f"the touches span {in_mm(touched)}, their points in the drawing {in_mm(drawn)}"
        raise DataError(f"{touches.source}: {both}; check the units of both and the names")
    return se3.best_fit(target, tips), target, np.ones_like(target, bool)


def _named(touches: Dataset, tips: np.ndarray, robot: Robot) -> Begun:
    names = shared.names_of(touches)
    at = {kind: tips[[name == kind for name in names]] for kind in KEEPS}
    if all(len(at[kind]) for kind in ("origin", "x", "xy")):
        _require_spread(touches, tips)
        origin, on_x, beside = (at[kind].mean(0) for kind in ("origin", "x", "xy"))
        x, z = on_x - origin, np.cross(on_x - origin, beside - origin)
    elif len(at["plane"]) > 2 and len(at["line"]) > 1 and len(at["end"]):
        _require_spread(touches, at["plane"])
        origin, x = at["end"].mean(0), at["line"][-1] - at["line"][0]
        z = np.linalg.svd(at["plane"] - at["plane"].mean(0))[2][-1]
        flange = shared.flanges(robot, touches.q)[:, :3, 3]
        z *= np.sign(z @ (flange - tips).mean(0)) or 1.0  # the arm is above
    else:
        raise DataError(f"{touches.source}: {len(touches)} touches do not make a frame; {LABELS}")
    y = np.cross(z, x) / np.linalg.norm(np.cross(z, x))
    z = z / np.linalg.norm(z)
    counts = np.array([[axis in KEEPS[name] for axis in "xyz"] for name in names])
    return se3.pose(np.stack([np.cross(y, z), y, z], axis=1), origin), np.zeros_like(tips), counts


def _require_spread(touches: Dataset, points: np.ndarray) -> None:
    sizes = np.linalg.svd(points - points.mean(0), compute_uv=False)
    if len(points) < 3 or sizes[1] < FLAT * max(sizes[0], shared.EXACT_SCATTER):
        why = f"{len(points)} points on one line don't determine the rotation about it"
        raise DataError(f"{touches.source}: {why}; touch three or more that span a plane")


def _solve(
    pose: np.ndarray, tips: np.ndarray, target: np.ndarray, counts: np.ndarray
) -> shared.TouchSolution | None:
    """The frame, from one that is near; None if the touches leave it open."""
    for _ in range(MAX_ROUNDS):
        local = se3.apply(se3.inverse(pose), tips)
        residual = (local - target).ravel()[counts]
        jacobian = np.concatenate([np.tile(np.eye(3), (len(tips), 1, 1)), -se3.skew(local)], axis=2)
        jacobian = jacobian.reshape(-1, 6)[counts]
        scale = np.repeat([1.0, max(float(np.abs(local).max()), shared.EXACT_SCATTER)], 3)
        if len(jacobian) < 6 or np.linalg.svd(jacobian / scale, compute_uv=False)[-1] < 1e-6:
            return None
        step = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        pose = pose @ se3.pose(se3.rotvec_to_matrix(step[3:]), step[:3])
        if np.abs(step).max() < 1e-12:
            break
    return shared.TouchSolution(pose, residual, np.linalg.inv(jacobian.T @ jacobian))

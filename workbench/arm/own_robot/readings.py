"""Possible meanings of a joint table and of numbers typed from a pendant: conventions, units, angle types."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.arm.robot_toml import robot_from_rows
from workbench.base import se3
from workbench.base.errors import FileError
from workbench.base.types import frozen

SIZES = {"m": 1.0, "mm": 1e-3, "rad": 1.0, "deg": float(np.deg2rad(1.0))}
STYLES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "roll, pitch, yaw": se3.rpy_to_matrix,
    "A, B, C (yaw, pitch, roll)": lambda v: se3.rpy_to_matrix(v[..., ::-1]),
    "rotation vector": se3.rotvec_to_matrix,
    "Euler angles z, y', z'' (Doosan, Kawasaki, Comau)": lambda v: _turned(v, "zyz"),
    "Euler angles x, y', z'' (Stäubli)": lambda v: _turned(v, "xyz"),
}
"""What three numbers of an orientation may mean."""


def _turned(angles: np.ndarray, axes: str) -> np.ndarray:
    """Rotation by three angles [rad], each about an axis of the frame that the last one left."""
    steps = [
        se3.rotvec_to_matrix(np.eye(3)["xyz".index(a)] * angles[..., k, None]) for k, a in enumerate(axes)
    ]
    return steps[0] @ steps[1] @ steps[2]


@dataclass(frozen=True, eq=False)
class Typed:
    """Joint positions and poses under one understanding of their units.

    Args:
        q: Joint positions [rad or m].
        poses: Of the flange in the robot's base.
        assumptions: What was assumed of the numbers, such as `joints in deg`.
    """

    q: Float[np.ndarray, "m n"]
    poses: Float[np.ndarray, "m 4 4"]
    assumptions: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class TableReading:
    """One way to read a table.

    Args:
        robot: The arm under it, with neither base nor tool.
        assumptions: What was assumed, such as `standard DH` or `lengths in mm`.
    """

    robot: Robot
    assumptions: tuple[str, ...] = ()


def table_readings(
    rows: Sequence[dict],
    *,
    conventions: Sequence[str] = ("dh", "craig"),
    lengths: Sequence[str] = ("m", "mm"),
    angles: Sequence[str] = ("rad", "deg"),
    name: str = "robot",
    limits=None,
) -> list[TableReading]:
    """What a joint table may mean.

    Args:
        rows: `theta`, `d`, `a`, `alpha` (`beta`, `type`) of every joint, as numbers stand there.
        conventions: That may be meant.
        lengths: Units that may be meant, the likeliest first.
        angles: The same for angles.
        name: Of the robot.
        limits: Of its joints [rad or m], if known.
    """
    titles = {"dh": "standard DH", "craig": "modified DH (Craig)"}
    lengths = possible(lengths, [float(r.get(c, 0.0)) for r in rows for c in ("d", "a")])
    angles = possible(angles, [float(r.get(c, 0.0)) for r in rows for c in ("theta", "alpha", "beta")])
    out: list[TableReading] = []
    refused: FileError | None = None
    for convention, length, angle in product(conventions, lengths, angles):
        scaled = [
            {
                key: value if key == "type" else float(value) * SIZES[length if key in ("d", "a") else angle]
                for key, value in row.items()
            }
            for row in rows
        ]
        try:
            robot = robot_from_rows(scaled, convention, name=name, limits=limits)
        except FileError as error:  # units that no arm has
            refused = error
            continue
        assumed = (titles.get(convention, convention), f"lengths in {length}", f"angles in {angle}")
        out.append(TableReading(robot.with_frames(base=Frame(), tool=Frame()), assumed))
    if refused is not None and not out:
        raise refused
    return out


def typed_readings(
    numbers: Float[np.ndarray, "m n6"], slides: Sequence[bool], *, joints: Sequence[str] = ("deg", "rad")
) -> list[Typed]:
    """What numbers typed from a pendant may mean: joints, then x, y, z and three of the orientation.

    Args:
        numbers: A row for each pose.
        slides: Which joints slide.
        joints: Units of the joints that turn that may be meant.
    """
    n = numbers.shape[1] - 6
    q, xyz, angles = numbers[:, :n], numbers[:, n : n + 3], numbers[:, n + 3 :]
    sliding = np.array(slides, bool)
    out = []
    for joint, length, angle, style in product(
        possible(joints, q[:, ~sliding]), possible(("mm", "m"), xyz), possible(("deg", "rad"), angles), STYLES
    ):
        turned = STYLES[style](angles * SIZES[angle])
        out.append(
            Typed(
                frozen(q * np.where(sliding, SIZES[length], SIZES[joint])),
                frozen(se3.pose(turned, xyz * SIZES[length])),
                (f"joints in {joint}", f"positions in {length}", f"orientations as {style} in {angle}"),
            )
        )
    return out


def possible(units: Sequence[str], values) -> Sequence[str]:
    """Those of two units in which some numbers make sense; both where either does."""
    largest = float(np.abs(values).max()) if np.size(values) else 0.0
    bounds = {"m": (0.0, 20.0), "mm": (5.0, np.inf), "rad": (0.0, 2.1 * np.pi), "deg": (0.0, np.inf)}
    kept = [u for u in units if bounds[u][0] <= largest <= bounds[u][1]]
    return kept or units

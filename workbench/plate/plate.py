"""Plate: a fixture with targets that the tool visits, and the region that the calibration is for.

All poses are in the frame of the robot's base. A target gives the pose that the tool has when it sits
there, so the same plate serves any arm that stands in the same place.
"""

from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm.plausible_units import MAX_DISTANCE
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.arguments import LengthAndAngle, admit
from workbench.base.array_checks import as_pose
from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.base.types import Matrix4, Vector3, frozen
from workbench.plate.region import Region
from workbench.plate.tolerances import EXACT, PIN_PLAY, USUAL, Production

AUTO = "auto"
"""Branch of a target whose inverse-kinematics solution is chosen by the program."""
ZERO = frozen(np.zeros(3))
SQUARE = frozen(np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))
"""Corners of a square of side 2 about its centre, anticlockwise."""


class Kind(StrEnum):
    """The degrees of freedom that a target constrains."""

    SEAT = "seat"
    SOCKET = "socket"
    POINT = "point"


def _check_lengths(record: Any, *names: str) -> None:
    """Refuse lengths that no plate before an arm has, such as those in millimetres."""
    for name in names:
        value = getattr(record, name)
        if value is not None and (size := float(np.abs(value).max())) > MAX_DISTANCE:
            wrong = f"{name} must be in m and at most {MAX_DISTANCE:g} m, got {size:g} m"
            raise OptionError(wrong, option=name, found=value)


@dataclass(frozen=True, eq=False)
class Target:
    """A place visited by the tool.

    Args:
        xyz: Position of the tool in the robot's base [m].
        rpy: Its roll, pitch, yaw [rad]; R = Rz(yaw) Ry(pitch) Rx(roll).
        branch: Name of the inverse-kinematics solution in which it is measured, or `auto`.
        q: The joint angles to measure it with, instead of a branch [rad or m].
        kind: Seat (full pose), socket or point (position only).
        sigma: Standard deviations of the target itself: position [m] and rotation [rad]; None if not stated.
        locked: Whether it keeps its place while others are moved or optimised.
    """

    xyz: Vector3
    rpy: Vector3 = field(default_factory=lambda: ZERO)
    branch: str = AUTO
    q: Float[np.ndarray, " n"] | None = None
    kind: Kind = Kind.SEAT
    sigma: LengthAndAngle | None = None
    locked: bool = False

    def __post_init__(self):
        admit(self)
        _check_lengths(self, "xyz")

    @classmethod
    def at(cls, pose: Matrix4, **fields: Any) -> "Target":
        """The target at a pose of the tool in the robot's base; `fields`: its other ones."""
        pose = as_pose(pose)
        return cls(frozen(pose[:3, 3].copy()), frozen(se3.matrix_to_rpy(pose[:3, :3])), **fields)

    @cached_property
    def pose(self) -> Matrix4:
        """Pose of the tool in the robot's base."""
        return frozen(se3.pose(se3.rpy_to_matrix(self.rpy), self.xyz))


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Plate:
    """A fixture.

    Args:
        targets: Its targets, in the order of measuring.
        region: The cuboid that the calibration is for.
        xyz: Centre of the plate's top in the robot's base [m].
        rpy: Its roll, pitch, yaw [rad].
        size: Length, width and thickness of the solid [m]; None if there is none.
        production: Its tolerances, and the play of its seats; exact by default.
    """

    name: str
    targets: tuple[Target, ...]
    region: Region
    xyz: Vector3 = field(default_factory=lambda: ZERO)
    rpy: Vector3 = field(default_factory=lambda: ZERO)
    size: Vector3 | None = None
    production: Production = EXACT
    notes: tuple[str, ...] = ()

    def __post_init__(self):
        admit(self)
        _check_lengths(self, "xyz", "size")
        if self.size is not None and not min(given := self.size.tolist()) > 0.0:
            text = f"length, width and thickness of a plate must be positive, got {given} m"
            raise OptionError(text, option="size", found=self.size)

    def check_targets(self) -> None:
        """Refuse a plate without any."""
        if not self.targets:
            raise DataError(f"plate '{self.name}' has no targets; add [[target]] tables", column="target")

    def check_joints(self, robot: Robot) -> None:
        """Refuse joint positions of targets that are of an arm with another number of joints."""
        for number, target in enumerate(self.targets, start=1):
            if target.q is not None and len(target.q) != robot.dof:
                raise ShapeError(
                    f"target {number} of plate '{self.name}' has {len(target.q)} joint positions, robot "
                    f"'{robot.name}' {robot.dof} joints; remove its q, or choose the robot that it is for",
                    expected=robot.dof,
                    found=len(target.q),
                )

    def __repr__(self) -> str:
        return f"<Plate {self.name}: {len(self)} targets; {self.assumptions}>"

    def __len__(self) -> int:
        return len(self.targets)

    @cached_property
    def pose(self) -> Matrix4:
        """Pose of the plate's top centre in the robot's base."""
        return frozen(se3.pose(se3.rpy_to_matrix(self.rpy), self.xyz))

    @cached_property
    def poses(self) -> Float[np.ndarray, "targets 4 4"]:
        """Poses of the tool at the targets in the robot's base."""
        return frozen(np.stack([t.pose for t in self.targets])) if self.targets else np.zeros((0, 4, 4))

    @cached_property
    def has_seats(self) -> bool:
        return any(target.kind is Kind.SEAT for target in self.targets)

    @property
    def heights(self) -> Float[np.ndarray, " targets"]:
        """Of the targets above the plate's top [m]."""
        return (se3.inverse(self.pose) @ self.poses)[:, 2, 3]

    @cached_property
    def known(self) -> Float[np.ndarray, "targets 2"]:
        """Standard deviation of each target, position [m] and rotation [rad]: as stated, or from the
        tolerances."""
        made = self.production.sigma(self.heights)
        for row, target in zip(made, self.targets, strict=True):
            row[:] = row if target.sigma is None else target.sigma
        return frozen(made)

    @cached_property
    def play(self) -> Float[np.ndarray, "targets 2"]:
        """Standard deviations of the probe in each target from its play: position [m], rotation [rad]."""
        seats = np.array([t.kind is Kind.SEAT for t in self.targets]).reshape(-1, 1)
        return frozen(np.where(seats, self.production.play_sigma, 0.0))

    @property
    def assumptions(self) -> str:
        """Assumptions about the targets, for people."""
        measured = [t.sigma for t in self.targets if t.sigma is not None]
        made, played = self.production.text
        parts = [made, played] if self.has_seats else [made]
        if not measured:
            return ", ".join(parts)
        position, rotation = np.sqrt(np.mean(np.square(measured), axis=0))
        count = "targets" if len(measured) == len(self) else f"{len(measured)} of {len(self)} targets"
        turns = f", {np.rad2deg(rotation):.2g}°" if self.has_seats else ""
        is_stated = len(measured) < len(self) and any(self.production.tolerance)
        known = f"{count} known to {1e3 * position:.2g} mm{turns} (one σ)"
        others = ", ".join(parts if is_stated else parts[1:])
        return f"{known}; {others}" if others else known

    @property
    def made_as_drawn(self) -> "Plate":
        """With what its drawing asks for: its tolerances, or usual ones, and the play of the pins."""
        asked = self.production if any(self.production.tolerance) else USUAL
        return replace(self, production=replace(asked, play=PIN_PLAY if self.has_seats else (0.0, 0.0)))

    def moved(self, xyz: Vector3, rpy: Vector3) -> "Plate":
        """The same plate elsewhere, with all its targets; their branches are to be chosen anew."""
        there = replace(self, xyz=xyz, rpy=rpy)
        moved = map(Target.at, there.pose @ se3.inverse(self.pose) @ self.poses)
        both = zip(self.targets, moved, strict=True)
        targets = (replace(t, xyz=at.xyz, rpy=at.rpy, branch=AUTO, q=None) for t, at in both)
        return replace(there, targets=tuple(targets))

    def with_joints(self, q: Float[np.ndarray, "targets n"], branches: tuple[str, ...]) -> "Plate":
        """The same plate, each target measured at its row of joint angles and in its named branch."""
        each = zip(self.targets, q, branches, strict=True)
        targets = (replace(t, q=frozen(row.copy()), branch=branch) for t, row, branch in each)
        return replace(self, targets=tuple(targets))

"""A robot: the elements of its arm, its joint data, and its base and tool frames.

The full chain is always T_b^0 · arm · T_n^e (ARIA eq. 6). A frame is written as a translation, a constant
rotation, and three small rotations about its own axes (`roll`, `pitch`, `yaw`, zero until identified), so
that no base or tool orientation is singular.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from workbench.arm.calibration_record import Calibration
from workbench.arm.chain import Axis, Chain, Element
from workbench.arm.effects import AbstractEffect, extrapolation_notes
from workbench.arm.effects.effect import flattened
from workbench.arm.effects.law import drifting, with_insertions
from workbench.base import se3
from workbench.base.errors import RobotError, ShapeError
from workbench.base.types import Freedom, Matrix3, Matrix4, Vector3, frozen

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from workbench.arm.motion import Motion

MOST_JOINTS = 50
"""Joints that move beyond this number are refused: what is computed from them would never end."""
BASE, TOOL = -1, -2
"""Link numbers of the elements of the base and of the tool."""
MASS_TOLERANCE, COM_TOLERANCE = 0.1, 0.015
"""How well a file's masses (relative) and centres of mass [m] are known, where it does not say."""
INERTIA = ("mass", "com_x", "com_y", "com_z")
"""What is known of the weight of a link."""
EXACT = 1e-6
"""Least standard deviation of a mass [kg] or centre [m]."""
FRAME_PARTS = ("x", "y", "z", "roll", "pitch", "yaw")
"""The six constants of a frame, in the order of the chain."""


class JointKind(StrEnum):
    """What a joint does."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    FIXED = "fixed"


@dataclass(frozen=True, eq=False, kw_only=True)
class Joint:
    """Data of one joint and the link after it, apart from the geometry.

    Args:
        name: `joint1` … for moving joints, `fixed1` … for the others.
        kind: Revolute, prismatic or fixed.
        limits: Least and greatest coordinate [rad or m]; infinite where there is none.
        mass: Mass of the link [kg]; None if unknown.
        com: Its centre of mass in the link frame [m].
        mass_tolerance: Relative standard deviation of the mass.
        com_tolerance: Standard deviation of the centre of mass, each axis [m].
        max_moment: Greatest moment about the axis [N m].
    """

    name: str
    kind: JointKind = JointKind.REVOLUTE
    limits: tuple[float, float] = (-np.inf, np.inf)
    mass: float | None = None
    com: Vector3 = field(default_factory=lambda: np.zeros(3))
    mass_tolerance: float = MASS_TOLERANCE
    com_tolerance: float = COM_TOLERANCE
    max_moment: float | None = None


@dataclass(frozen=True, eq=False)
class Frame:
    """Pose of a frame, and whether it is to be identified.

    Args:
        xyz: Position [m].
        rotation: Rotation matrix.
        free: Fixed, free, or decided from the data.
    """

    xyz: Vector3 = field(default_factory=lambda: np.zeros(3))
    rotation: Matrix3 = field(default_factory=lambda: np.eye(3))
    free: Freedom = Freedom.FIXED

    @classmethod
    def from_pose(cls, pose: Matrix4, free: Freedom = Freedom.FIXED) -> "Frame":
        """The frame at a 4×4 pose."""
        return cls(frozen(pose[:3, 3].copy()), frozen(pose[:3, :3].copy()), free)

    @cached_property
    def pose(self) -> Matrix4:
        """The 4×4 pose."""
        return frozen(se3.pose(self.rotation, self.xyz))

    @property
    def rpy(self) -> Vector3:
        """Roll, pitch, yaw [rad]."""
        return se3.matrix_to_rpy(self.rotation)

    def elements(self, name: str, link: int) -> tuple[Element, ...]:
        """The frame as elements `name.x` … `name.yaw`."""
        turn = se3.pose(self.rotation, np.zeros(3))
        return (
            *(
                Element(Axis(Axis.TX + i), f"{name}.{part}", float(self.xyz[i]), link=link)
                for i, part in enumerate(FRAME_PARTS[:3])
            ),
            Element(Axis.CONSTANT, f"{name}.rotation", link=link, matrix=frozen(turn)),
            *(Element(Axis(i), f"{name}.{part}", link=link) for i, part in enumerate(FRAME_PARTS[3:])),
        )

    def moved(self, parts: Float[np.ndarray, "6"]) -> "Frame":
        """The frame with position parts[:3] and turned by the small rotations parts[3:]."""
        turn = np.eye(3)
        for axis in range(3):
            turn = turn @ se3.rotvec_to_matrix(np.eye(3)[axis] * parts[3 + axis])
        return replace(self, xyz=frozen(np.array(parts[:3])), rotation=frozen(self.rotation @ turn))


@dataclass(frozen=True)
class UrdfSource:
    """The file that a robot came from: for its meshes, and for writing a calibrated copy.

    Args:
        path: The URDF.
        joints: Names in the file of the robot's joint entries, in order.
        root: First link of the chain.
        tip: Last link of the chain.
    """

    path: Path
    joints: tuple[str, ...]
    root: str
    tip: str


@dataclass(frozen=True, eq=False)
class SessionFrames:
    """Base and tool of one session of measurements."""

    name: str
    base: Frame
    tool: Frame


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Robot:
    """A serial arm: geometry, joints, base and tool.

    Args:
        name: For people.
        convention: The form in which it was read (`hayati`, `craig`, `urdf`, …).
        elements: The arm's elements, without base and tool.
        joints: One per joint entry, moving or fixed.
        link_ends: Element of the arm after which each joint entry's link frame lies.
        base: Pose of the arm's first frame in the measuring frame.
        tool: Pose of the tool in the arm's last frame.
        sessions: Base and tool of single sessions, where they differ.
        gravity: Acceleration in the robot's base frame [m/s²].
        urdf: The URDF file that it came from, if any.
        effects: What bends the arm beside its geometry; acts wherever poses are computed from a `Motion`.
        notes: Decisions that its reader took, one sentence each.
        calibration: What a calibrated arm says of where its values come from.
    """

    name: str
    convention: str
    elements: tuple[Element, ...]
    joints: tuple[Joint, ...]
    link_ends: tuple[int, ...]
    base: Frame = field(default_factory=Frame)
    tool: Frame = field(default_factory=Frame)
    sessions: tuple[SessionFrames, ...] = ()
    gravity: Vector3 = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    urdf: UrdfSource | None = None
    effects: tuple[AbstractEffect, ...] = ()
    notes: tuple[str, ...] = ()
    calibration: Calibration | None = None

    def __post_init__(self):
        if not self.name.isprintable():  # it is written into programs and files of others
            raise RobotError(f"the robot's name {self.name!a} has control characters; remove them")
        if not any(e.joint is not None for e in self.elements):
            raise RobotError(f"robot '{self.name}' has no joint that moves; give at least one")
        if self.dof > MOST_JOINTS:
            raise RobotError(f"'{self.name}' has {self.dof} joints that move; at most {MOST_JOINTS} may move")
        names = Counter(e.name for e in self.elements)
        if len(names) != len(self.elements):
            double = next(name for name, count in names.items() if count > 1)
            raise RobotError(f"robot '{self.name}' has two elements called '{double}'; rename one")
        if self.effects:
            self._check_effects(set(names))

    @classmethod
    def from_dh(
        cls, table: Any, convention: str = "dh", *, name: str = "robot", limits: Any | None = None
    ) -> "Robot":
        """The arm of a Denavit–Hartenberg table, its base and tool to be decided from the data.

        Args:
            table: A row for each joint: `theta, d, a, alpha` (and `beta`) [rad, m] in this order, whatever
                the convention; or a mapping with these names, `type`, `limits` … as in a robot's TOML file;
                or a data frame with such columns.
            convention: `dh`, `hayati`, `craig`, `craig-hayati` or `three-rotation`.
            name: For people.
            limits: Least and greatest position of each moving joint [rad or m].

        Raises:
            FileError, RobotError: the table describes no robot; the message names the entry.
        """
        from workbench.arm.robot_toml import robot_from_rows

        return robot_from_rows(table, convention, name=name, limits=limits)

    @classmethod
    def from_urdf(cls, path: Path | str, *, tip: str | None = None) -> "Robot":
        """The longest chain of a URDF, or the one that ends in the link `tip`."""
        from workbench.arm.urdf import read_urdf

        return read_urdf(path, tip=tip)

    def save(self, path: Path | str) -> Path:
        """Write the robot as the ending says: `.toml`, or `.urdf` for its geometry, best without effects."""
        from workbench.arm.built_in_arms import save_robot

        return save_robot(self, path)

    def __repr__(self) -> str:
        words = f"{self.dof} joints, {self.convention}, {len(self.default_free)} constants to identify"
        if self.effects:
            words += f", effects: {', '.join(str(e.name) for e in self.effects)}"
        return f"<Robot {self.name}: {words}>"

    @cached_property
    def chain(self) -> Chain:
        """Base, arm and tool as one chain, with the rotations of value 0 that effects turn."""
        base, tool = self.base.elements("base", BASE), self.tool.elements("tool", TOOL)
        arm = with_insertions(self.elements, self.dof, self.effects) if self.effects else self.elements
        return Chain((*drifting(base, self.effects), *arm, *tool), self.dof)

    @cached_property
    def base_size(self) -> int:
        """Number of elements of the base at the beginning of the full chain."""
        return len(drifting(self.base.elements("base", BASE), self.effects))

    @cached_property
    def chain_ends(self) -> tuple[int, ...]:
        """Element of the full chain after which each joint entry's link frame lies."""
        if not self.effects:
            return tuple(self.base_size + end for end in self.link_ends)
        own = {e.name for e in self.elements}
        ends = []
        for end in self.link_ends:
            last = self.chain.index[self.elements[end].name]
            while ".bend_" in self.chain.elements[last + 1].name and (
                self.chain.elements[last + 1].name not in own
            ):
                last += 1
            ends.append(last)
        return tuple(ends)

    @cached_property
    def coefficients(self) -> dict[str, float]:
        """Coefficients of all effects by name, such as `joint3.compliance`, SI."""
        return {n: c for e in self.effects for n, c in zip(e.names, e.coefficients, strict=True)}

    @cached_property
    def coefficient_units(self) -> dict[str, str]:
        """Their units."""
        return {n: u for e in self.effects for n, u in zip(e.names, e.units(self.chain), strict=True)}

    @cached_property
    def inertia(self) -> dict[str, float]:
        """Mass [kg] and centre of mass [m] of every link that weighs: `joint3.mass`, `joint3.com_x` …"""
        heavy = [j for j in self.joints if j.mass]
        return {
            f"{j.name}.{p}": float(v) for j in heavy for p, v in zip(INERTIA, (j.mass, *j.com), strict=True)
        }

    @cached_property
    def inertia_tolerance(self) -> dict[str, float]:
        """Their standard deviations, by the same names."""
        heavy = [j for j in self.joints if j.mass]
        sizes = [(j, (j.mass_tolerance * (j.mass or 0.0), *[j.com_tolerance] * 3)) for j in heavy]
        return {
            f"{j.name}.{p}": max(float(s), EXACT)
            for j, each in sizes
            for p, s in zip(INERTIA, each, strict=True)
        }

    @cached_property
    def moving(self) -> tuple[Joint, ...]:
        """The joints that have a coordinate, in the order of q."""
        return tuple(j for j in self.joints if j.kind is not JointKind.FIXED)

    @property
    def dof(self) -> int:
        """Number of joint coordinates."""
        return len(self.moving)

    @cached_property
    def limits(self) -> Float[np.ndarray, "n 2"]:
        """Least and greatest coordinate of every moving joint [rad or m]."""
        return frozen(np.array([j.limits for j in self.moving], float))

    @cached_property
    def search_limits(self) -> Float[np.ndarray, "n 2"]:
        """The limits, with one turn either way (or 1 m) where a joint has none: for searches."""
        spans = np.array([1.0 if j.kind is JointKind.PRISMATIC else np.pi for j in self.moving])[:, None]
        return frozen(np.where(np.isfinite(self.limits), self.limits, np.array([-1.0, 1.0]) * spans))

    @property
    def has_masses(self) -> bool:
        """Whether every link after a moving joint has a mass."""
        return all(j.mass is not None for j in self.moving)

    @cached_property
    def reach(self) -> float:
        """Sum of the arm's lengths [m]: its scale, and a bound that offsets keep it from reaching."""
        reach = float(np.linalg.norm(self.tool.xyz))
        for e in self.elements:
            if e.matrix is not None:
                reach += float(np.linalg.norm(e.matrix[:3, 3]))
            elif not e.axis.turns:
                reach += abs(e.value)
        for joint in self.moving:
            if joint.kind is JointKind.PRISMATIC:
                reach += float(np.nanmax(np.abs(np.where(np.isfinite(joint.limits), joint.limits, 0.0))))
        return reach

    @cached_property
    def default_free(self) -> tuple[str, ...]:
        """Names of the arm's constants that are identified unless the user says otherwise."""
        return tuple(e.name for e in self.elements if e.free)

    @cached_property
    def joint_offsets(self) -> tuple[str, ...]:
        """Names of the constants that a level-1 calibration identifies: where each joint has its zero."""
        return tuple(e.name for e in self.elements if e.joint is not None)

    def values(self, names: tuple[str, ...]) -> Float[np.ndarray, " p"]:
        """Present values of the named constants."""
        return self.chain.values[self.chain.indices(names)]

    def with_values(self, values: Mapping[str, float]) -> "Robot":
        """The same robot with other constants, coefficients or masses; `base.…`, `tool.…` move the frames."""
        chain = self.chain
        if unknown := set(values) - set(chain.index) - set(self.coefficients) - set(self.inertia):
            raise RobotError(f"robot '{self.name}' has no constant '{sorted(unknown)[0]}'")
        elements = tuple(
            replace(e, value=float(values[e.name])) if e.name in values else e for e in self.elements
        )

        def moved(frame: Frame, name: str) -> Frame:
            keys = [f"{name}.{part}" for part in FRAME_PARTS]
            if not any(k in values for k in keys):
                return frame
            return frame.moved(np.array([values.get(k, chain.values[chain.index[k]]) for k in keys]))

        effects = tuple(e.sized(values) for e in self.effects)
        return replace(
            self,
            joints=self.joints if self.inertia.keys().isdisjoint(values) else self._reweighed(values),
            elements=elements,
            base=moved(self.base, "base"),
            tool=moved(self.tool, "tool"),
            effects=effects,
        )

    def _reweighed(self, values: Mapping[str, float]) -> tuple[Joint, ...]:
        """The joints with other masses and centres."""
        out = []
        for joint in self.joints:
            own = [joint.mass, *joint.com]
            mass, *com = (values.get(f"{joint.name}.{p}", v) for p, v in zip(INERTIA, own, strict=True))
            out.append(replace(joint, mass=mass, com=frozen(np.array(com, float))))
        return tuple(out)

    def with_effects(self, *effects: AbstractEffect | Sequence[AbstractEffect]) -> "Robot":
        """The same arm with these effects, one by one or in a list, instead of its own."""
        return replace(self, effects=flattened(effects))

    def with_frames(self, *, base: Frame | None = None, tool: Frame | None = None) -> "Robot":
        """The same arm on another base or with another tool; itself if they are its own already."""
        base, tool = base or self.base, tool or self.tool
        return self if base is self.base and tool is self.tool else replace(self, base=base, tool=tool)

    def session_frames(self, session: str) -> SessionFrames:
        """Base and tool of a session: its own where the robot has them, else the common ones."""
        for frames in self.sessions:
            if frames.name == session:
                return frames
        return SessionFrames(session, self.base, self.tool)

    def in_session(self, session: str) -> "Robot":
        """The arm on the base and with the tool of a session."""
        frames = self.session_frames(session)
        return self.with_frames(base=frames.base, tool=frames.tool)

    def predict(self, at: "ArrayLike | Motion") -> np.ndarray:
        """Pose of the tool in the measuring frame: (4, 4) at one pose, (rows, 4, 4) at several.

        Args:
            at: Joint positions of one pose or of several [rad or m], or a `Motion` that also says what drives
                the effects.

        Raises:
            ShapeError: another number of joint positions than the robot has joints.
            DataError: an effect lacks what drives it, such as a temperature.
        """
        from workbench.arm.kinematics.array_like import tool_poses

        return tool_poses(self, at)

    def _check_effects(self, own: set[str]) -> None:
        """Refuse effects that the arm can't carry, and names that stand for two things."""
        taken = set(own)
        for effect in self.effects:
            effect.check(self.chain)
        inserted = [e.name for e in self.chain.elements]
        for name in [*(n for e in self.effects for n in e.names), *inserted]:
            if name in taken and name not in own:
                raise RobotError(f"robot '{self.name}' has '{name}' twice among its effects; merge them")
            taken.add(name)
        if len(self.chain.index) != len(self.chain.elements) or set(inserted) & set(self.coefficients):
            raise RobotError(f"robot '{self.name}' has an element with the name of an effect's; rename it")

    def extrapolation_warnings(self, q: np.ndarray, rows: np.ndarray | None = None) -> list[str]:
        """A sentence for every effect that fades out in some rows; arguments of `extrapolation_notes`."""
        return extrapolation_notes(self.effects, self.chain, q, rows)

    def check_joints(self, q: np.ndarray, source: str = "joint positions") -> None:
        """Refuse rows with another number of joints than the robot has."""
        if q.ndim != 2 or q.shape[1] != self.dof:
            found = q.shape[-1] if q.ndim else 0
            raise ShapeError(
                f"{source}: rows of {found} numbers, but robot '{self.name}' has {self.dof} joints; give one "
                "for each joint, or choose the robot that was measured",
                expected=self.dof,
                found=found,
            )

"""A robot: the elements of its arm, its joint data, and its base and tool frames.

The full chain is always T_b^0 · arm · T_n^e (ARIA eq. 6).
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from workbench.arm.calibration_record import Calibration
from workbench.arm.chain import Chain, Element, poses
from workbench.arm.effects import AbstractEffect, extrapolation_notes
from workbench.arm.effects.effect import check_together, flattened, turned, with_insertions
from workbench.arm.frame import BASE, TOOL, Frame, revised
from workbench.arm.gravity import GRAVITY
from workbench.arm.joint import Joint, JointKind
from workbench.arm.mounting import DOWN, Mounting
from workbench.base.errors import OptionError, RobotError, ShapeError
from workbench.base.types import Vector3, frozen
from workbench.base.wording import plural

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from workbench.arm.motion import Motion

MAX_JOINTS = 50
"""Maximum number of moving joints, to bound computing times."""
UNUSUAL_REACH, CHECKED_POSES = 15.0, 16
"""Sum of an arm's lengths [m] beyond which some cancel, and poses that tell its reach then."""


@dataclass(frozen=True)
class UrdfSource:
    """The file that a robot came from: for its meshes, and for writing a calibrated copy.

    Args:
        path: The URDF.
        joints: Names in the file of the robot's joint entries, in order.
        root: First link of the chain.
    """

    path: Path
    joints: tuple[str, ...]
    root: str


ENDS = ("base_link", "flange")


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Robot:
    """A serial arm: geometry, joints, base and tool.

    Args:
        name: For people.
        convention: The convention of its file (`hayati`, `craig`, `urdf`, …).
        elements: The arm's elements, without base and tool.
        joints: One per joint entry, moving or fixed.
        link_ends: Element of the arm after which each joint entry's link frame lies.
        mounting: Base, tool and gravity.
        sessions: Mountings of single sessions, if different, by name.
        ends: Names of the first and the last link in a URDF.
        urdf: The URDF file that it came from, if any.
        effects: Its effects; included wherever poses are computed from a `Motion`.
        notes: Decisions by its reader, one sentence each.
        calibration: Record of the calibration that its values come from.
    """

    name: str
    convention: str
    elements: tuple[Element, ...]
    joints: tuple[Joint, ...]
    link_ends: tuple[int, ...]
    mounting: Mounting = field(default_factory=Mounting)
    sessions: Mapping[str, Mounting] = field(default_factory=dict)
    ends: tuple[str, str] = ENDS
    urdf: UrdfSource | None = None
    effects: tuple[AbstractEffect, ...] = ()
    notes: tuple[str, ...] = ()
    calibration: Calibration | None = None

    def __post_init__(self):
        if self.gravity is not DOWN and any(m.gravity is DOWN for m in self.sessions.values()):
            up, every = self.gravity, self.sessions.items()
            own = {n: replace(m, gravity=up) if m.gravity is DOWN else m for n, m in every}
            object.__setattr__(self, "sessions", own)
        if not self.name.isprintable():  # it is written into programs and third-party files
            wrong = "contains control characters; remove them"
            raise RobotError(f"the robot's name {self.name!a} {wrong}", found=self.name)
        driven = [e.joint for e in self.elements if e.joint is not None]
        if not driven or driven != list(range(self.dof)):
            order = f"joints 1 to {max(self.dof, 1)}, one each and in this order"
            said = f"must be driven by {order}; they name {[j + 1 for j in driven]}"
            raise RobotError(f"the elements of robot '{self.name}' {said}")
        if self.dof > MAX_JOINTS:
            raise RobotError(f"'{self.name}' has {self.dof} joints that move; at most {MAX_JOINTS} may move")
        names = Counter(e.name for e in self.elements)
        if len(names) != len(self.elements):
            double = next(name for name, count in names.items() if count > 1)
            raise RobotError(f"robot '{self.name}' has two elements called '{double}'; rename one")
        if self.effects:
            check_together(self.effects, self.chain, names.keys())

    @classmethod
    def from_dh(
        cls, table: Any, convention: str = "dh", *, name: str = "robot", limits: Any | None = None
    ) -> "Robot":
        """The arm of a Denavit–Hartenberg table, with base and tool to be decided from the data.

        Args:
            table: A row for each joint: `theta, d, a, alpha` (and `beta`) [rad, m] in this order, whatever
                the convention; or a mapping with these names, `type`, `limits` … as in a robot's TOML file;
                or a data frame with such columns.
            convention: `dh`, `hayati`, `craig`, `craig-hayati` or `three-rotation`.
            name: For people.
            limits: Minimum and maximum position of each moving joint [rad or m].

        Raises:
            FileError, RobotError: the table describes no robot; the message names the entry.
        """
        from workbench.arm.robot_toml import robot_from_rows

        return robot_from_rows(table, convention, name=name, limits=limits)

    def save(self, path: Path | str, *, force: bool = False) -> Path:
        """Write the robot in the format of the extension: `.toml`, or `.urdf` for its best geometry without
        effects; one that is worse than nominal on its own rows only with `force`."""
        from workbench.arm.built_in_arms import save_robot

        return save_robot(self, path, force=force)

    def __repr__(self) -> str:
        free = plural(len(self.default_free), "constant")
        text = f"{plural(self.dof, 'joint')}, {self.convention}, {free} to identify"
        if self.effects:
            text += f", effects: {', '.join(str(e.name) for e in self.effects)}"
        return f"<Robot {self.name}: {text}>"

    @property
    def base(self) -> Frame:
        return self.mounting.base

    @property
    def tool(self) -> Frame:
        return self.mounting.tool

    @property
    def gravity(self) -> Vector3:
        return self.mounting.gravity

    @cached_property
    def chain(self) -> Chain:
        """Base, arm and tool as one chain, with the inserted rotations of value 0 for effects."""
        base, tool = self.base.elements("base", BASE), self.tool.elements("tool", TOOL)
        arm = with_insertions(self.elements, self.dof, self.effects) if self.effects else self.elements
        return Chain((*turned(base, self.effects), *arm, *turned(tool, self.effects)), self.dof)

    @cached_property
    def base_size(self) -> int:
        """Number of elements of the base at the beginning of the full chain."""
        return len(turned(self.base.elements("base", BASE), self.effects))

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
        return {n: u for e in self.effects for n, u in zip(e.names, e.units(self.chain), strict=True)}

    @cached_property
    def inertia(self) -> dict[str, float]:
        """Mass [kg] and centre of mass [m] of every link with a mass: `joint3.mass`, `joint3.com_x` …"""
        return {name: value for j in self.joints for name, value in j.inertia.items()}

    @cached_property
    def inertia_tolerance(self) -> dict[str, float]:
        """Their standard deviations, by the same names."""
        return {name: size for j in self.joints for name, size in j.inertia_tolerance.items()}

    @cached_property
    def moving(self) -> tuple[Joint, ...]:
        """The joints that have a coordinate, in the order of q."""
        return tuple(j for j in self.joints if j.kind is not JointKind.FIXED)

    @property
    def dof(self) -> int:
        """Number of joint coordinates."""
        return len(self.moving)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the moving joints in the robot's file, else joint1, joint2, …"""
        return tuple(joint.label or joint.name for joint in self.moving)

    @cached_property
    def limits(self) -> Float[np.ndarray, "n 2"]:
        """Minimum and maximum coordinate of every moving joint [rad or m]."""
        return frozen(np.array([j.limits for j in self.moving], float))

    @cached_property
    def search_limits(self) -> Float[np.ndarray, "n 2"]:
        """The limits, with one turn either way (or 1 m) for joints without any, for searches."""
        spans = np.array([1.0 if j.kind is JointKind.PRISMATIC else np.pi for j in self.moving])[:, None]
        return frozen(np.where(np.isfinite(self.limits), self.limits, np.array([-1.0, 1.0]) * spans))

    @property
    def has_masses(self) -> bool:
        """Whether every link after a moving joint has a mass."""
        return all(j.mass is not None for j in self.moving)

    @cached_property
    def reach(self) -> float:
        """Sum of the arm's lengths [m]: an upper bound of its reach, used as its scale.

        A sum beyond any arm, as of offsets along nearly parallel axes that cancel, is none: then it is the
        maximum distance of the tool from the base over a few joint positions.
        """
        reach = float(np.linalg.norm(self.tool.xyz))
        for e in self.elements:
            if e.matrix is not None:
                reach += float(np.linalg.norm(e.matrix[:3, 3]))
            elif not e.axis.turns:
                reach += abs(e.value)
        limits = np.where(np.isfinite(self.limits), self.limits, 0.0).reshape(-1, 2)
        slides = np.array([j.kind is JointKind.PRISMATIC for j in self.moving], bool)
        reach += float(np.abs(limits[slides]).max(1).sum())
        if reach <= UNUSUAL_REACH:
            return reach
        low, high = np.where(slides, limits.T, [[-np.pi], [np.pi]])
        q = np.random.default_rng(0).uniform(low, high, (CHECKED_POSES, self.dof))
        chain = self.with_effects().with_frames(base=Frame()).chain
        return float(np.linalg.norm(poses(chain, q)[:, :3, 3], axis=1).max())

    @cached_property
    def default_free(self) -> tuple[str, ...]:
        """Names of the arm's constants that are identified by default."""
        return tuple(e.name for e in self.elements if e.free)

    @cached_property
    def joint_offsets(self) -> tuple[str, ...]:
        """Names of the constants that a level-1 calibration identifies: zero offsets of the joints."""
        return tuple(e.name for e in self.elements if e.joint is not None)

    def values(self, names: tuple[str, ...]) -> Float[np.ndarray, " p"]:
        """Current values of the named constants."""
        names = (names,) if isinstance(names, str) else tuple(names)
        return self.chain.values[self.chain.indices(names)]

    def with_values(self, values: Mapping[str, float]) -> "Robot":
        """The same robot with other constants, coefficients or masses.

        Those of base, tool and gravity are `base.…`, `tool.…` and `gravity.…` (`Mounting.with_values`).
        """
        values = _numbers_by_name(values)
        known = self.chain.index.keys() | self.coefficients.keys() | self.inertia.keys() | set(GRAVITY)
        if unknown := values.keys() - known:
            raise RobotError(f"robot '{self.name}' has no constant '{sorted(unknown)[0]}'")
        elements = [revised(e, value=float(values[e.name])) if e.name in values else e for e in self.elements]
        mounting = self.mounting.with_values(values)
        return revised(
            self.under(mounting.gravity),
            joints=tuple(j.reweighed(values) for j in self.joints),
            elements=tuple(elements),
            mounting=mounting,
            effects=tuple(e.sized(values) for e in self.effects),
        )

    def with_effects(self, *effects: AbstractEffect | Sequence[AbstractEffect]) -> "Robot":
        """The same arm with these effects, one by one or in a list, instead of its own."""
        return replace(self, effects=flattened(effects))

    def with_frames(self, *, base: Frame | None = None, tool: Frame | None = None) -> "Robot":
        """The same arm on another base or with another tool; itself if they are unchanged."""
        base, tool = self.base if base is None else base, self.tool if tool is None else tool
        if base is self.base and tool is self.tool:
            return self
        return revised(self, mounting=replace(self.mounting, base=base, tool=tool))

    def under(self, gravity: Vector3) -> "Robot":
        """The same arm under another gravity, which also applies to sessions without their own."""
        if gravity is self.gravity:
            return self
        sessions = {
            name: replace(m, gravity=gravity) if m.gravity is self.gravity else m
            for name, m in self.sessions.items()
        }
        return revised(self, mounting=replace(self.mounting, gravity=gravity), sessions=sessions)

    def recorded(self, **entries: Any) -> "Robot":
        """The same arm with these entries in the record of its calibration, if it has one."""
        if self.calibration is None:
            return self
        return replace(self, calibration=replace(self.calibration, **entries))

    def weighed_as(self, other: "Robot") -> "Robot":
        """The same arm with the masses and the gravity of another one of its kind."""
        return replace(
            self,
            joints=tuple(j.reweighed(other.inertia) for j in self.joints),
            mounting=replace(self.mounting, gravity=other.gravity),
            sessions={n: replace(m, gravity=other.in_session(n).gravity) for n, m in self.sessions.items()},
        )

    def in_session(self, session: str) -> "Robot":
        """The arm with the mounting of a session, or the common one if it has none."""
        mounting = self.sessions.get(session, self.mounting)
        return revised(self, mounting=mounting, sessions={}) if self.sessions else self

    @property
    def in_first_session(self) -> "Robot":
        """The arm in the first of its sessions, for files of a single arm."""
        return self.in_session(next(iter(self.sessions), ""))

    @cached_property
    def bare(self) -> "Robot":
        """The geometry alone, from its first frame to its last: without effects and sessions."""
        mounting = revised(self.mounting, base=Frame(), tool=Frame())
        return revised(self, mounting=mounting, sessions={}, effects=())

    def predict(self, at: "ArrayLike | Motion") -> np.ndarray:
        """Pose of the tool in the measuring frame: (4, 4) at one pose, (rows, 4, 4) at several.

        Args:
            at: Joint positions of one pose or of several [rad or m], or a `Motion` with drivers of the
                effects.

        Raises:
            ShapeError: another number of joint positions than the robot has joints.
            DataError: an effect lacks its driver, such as temperature.
        """
        from workbench.arm.kinematics.forward import tool_poses

        return tool_poses(self, at)

    def extrapolation_warnings(self, q: np.ndarray, rows: np.ndarray | None = None) -> list[str]:
        """A sentence for every effect that fades out in some rows; arguments of `extrapolation_notes`."""
        return extrapolation_notes(self.effects, self.chain, q, rows)

    def check_joints(self, q: np.ndarray, source: str = "joint positions") -> None:
        """Refuse rows with another number of joints than the robot has."""
        q = np.asarray(q)
        if q.ndim != 2 or q.shape[1] != self.dof:
            raise ShapeError(
                f"{source}: robot '{self.name}' has {self.dof} joints, got an array of shape {q.shape}; "
                "give a row of joints for each pose, or choose the robot that was measured",
                expected=self.dof if q.ndim == 2 else 2,
                found=q.shape[1] if q.ndim == 2 else q.ndim,
            )


def _numbers_by_name(values: Mapping[str, float]) -> Mapping[str, float]:
    """Values of constants, each a number in SI."""
    if not hasattr(values, "keys"):
        wrong = f"values must be a mapping from names to numbers, got {type(values).__name__}"
        raise OptionError(wrong, option="values", found=values)
    for name, value in values.items():
        is_number = type(value) is float or (isinstance(value, Real) and not isinstance(value, bool))
        if not is_number or not isfinite(value):
            text = f"the value of {name} must be a finite number in rad, m or its own SI unit, got {value!r}"
            raise OptionError(text, option=str(name), found=value)
    return values

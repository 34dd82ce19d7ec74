"""A serial arm as frames at its joints: the structure of URDF, MJCF and drivers' kinematics files.

    T(q) = B_1 O_1 M_1(q_1) B_2 O_2 M_2(q_2) … F

O_k is the frame of joint k in the link before it, M_k the motion about (along) a fixed axis of that frame,
B_k the transform of fixed joints of a URDF in between, F the flange after the last joint. A joint's frame may
be rotated about its axis and shifted along it if the next frame compensates: meshes refer to these frames.
For tables, constants on the driven axis (θ and d of a DH row) are part of O_k, as in the drivers' files;
other arms keep the frames of their file, or those of a file to be updated.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from workbench.arm import chain as chains
from workbench.arm.chain import Axis, Element
from workbench.arm.conventions import CONSTANTS
from workbench.arm.inverse.reduced_arm import ONTO_Z
from workbench.arm.robot import Joint, JointKind, Robot
from workbench.arm.urdf import driven_elements, origin_elements
from workbench.base import se3
from workbench.base.errors import RobotError
from workbench.base.types import Matrix4, Vector3, frozen

PARALLEL = 3e-9
"""Sine of the angle below which two axes count as parallel, as their normal is lost in rounding."""
SAME_AXIS = 1e-15
"""Distance [m] and sine of the angle below which two axes are one."""
Z = frozen(np.array([0.0, 0.0, 1.0]))


@dataclass(frozen=True, eq=False)
class JointFrame:
    """One joint.

    Args:
        joint: Its data.
        origin: O, its frame in the link before it.
        axis: Unit vector about (along) which it moves, in its own frame.
        before: B, the transform of fixed joints before it.
    """

    joint: Joint
    origin: Matrix4
    axis: Vector3 = field(default_factory=lambda: Z)
    before: Matrix4 = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, eq=False)
class JointFrames:
    """All joints of an arm, and its flange in the last joint's frame."""

    joints: tuple[JointFrame, ...]
    flange: Matrix4

    @property
    def at_zero(self) -> list[Matrix4]:
        """Frames of the joints, and of the flange, in the arm's base with all joints at 0."""
        poses, here = [], np.eye(4)
        for joint in self.joints:
            here = here @ joint.before @ joint.origin
            poses.append(here)
        return [*poses, here @ self.flange]

    def with_origins(self, origins: Sequence[Matrix4], flange: Matrix4) -> "JointFrames":
        """The same joints with other origins."""
        pairs = zip(self.joints, origins, strict=True)
        return JointFrames(tuple(replace(j, origin=frozen(o)) for j, o in pairs), frozen(flange))

    def matched(self, origins: Sequence[Matrix4]) -> "JointFrames":
        """The same arm with its joints' frames rotated about their axes to match others if possible."""
        moves, wanted = [], np.eye(4)
        for joint, origin, own in zip(self.joints, origins, self.at_zero, strict=False):
            wanted = wanted @ joint.before @ origin
            turn = own[:3, :3].T @ wanted[:3, :3]
            w, *v = se3.matrix_to_quaternion(turn)
            angle = 2.0 * np.arctan2(joint.axis @ np.array(v), w)
            along = joint.axis @ own[:3, :3].T @ (wanted[:3, 3] - own[:3, 3])
            moves.append(se3.pose(se3.rotvec_to_matrix(joint.axis * angle), joint.axis * along))
        places = self.at_zero
        moved = [p @ m for p, m in zip(places, moves, strict=False)]
        steps = [se3.inverse(a) @ b for a, b in pairwise([np.eye(4), *moved, places[-1]])]
        new = [se3.inverse(j.before) @ s for j, s in zip(self.joints, steps, strict=False)]
        return self.with_origins(new, steps[-1])

    def robot(self, like: Robot) -> Robot:
        """An arm of these frames, six corrections each to identify, with the tool of another; no masses."""
        elements: list[Element] = []
        ends = []
        for k, frame in enumerate(self.joints):
            name = f"joint{k + 1}"
            elements += origin_elements(name, frame.before @ frame.origin, k)
            elements += driven_elements(name, frame.joint.kind, frame.axis, k, k)
            ends.append(len(elements) - 1)
        last = len(self.joints) - 1
        elements.append(Element(Axis.CONSTANT, "flange.origin", link=last, matrix=frozen(self.flange)))
        return Robot(
            name=like.name,
            convention="frames",
            elements=tuple(elements),
            joints=tuple(
                replace(f.joint, name=f"joint{k + 1}", mass=None) for k, f in enumerate(self.joints)
            ),
            link_ends=(*ends[:-1], len(elements) - 1),
            mounting=like.mounting,
        )


def joint_frames(robot: Robot) -> JointFrames:
    """Frames at an arm's joints, from its geometry alone, without base and tool."""
    if len(robot.chain.followers):
        name = robot.chain.elements[robot.chain.followers[0]].name.split(".")[0]
        raise RobotError(
            f"{name} of robot '{robot.name}' follows another joint, which this form can't represent; use "
            "TOML or URDF"
        )
    return _of_urdf(robot) if robot.urdf is not None else _of_elements(robot)


def still(*elements: Element) -> Matrix4:
    """The transform of elements with their joints at 0, and followers without their offsets."""
    parts = tuple(replace(e, joint=None, follows=None, value=e.value * (e.follows is None)) for e in elements)
    return chains.poses(chains.Chain(parts, 0), np.zeros((1, 0)))[0]


def _of_urdf(robot: Robot) -> JointFrames:
    """The frames in the file, with their own axes."""
    found: list[JointFrame] = []
    before = np.eye(4)
    for link, joint in enumerate(robot.joints):
        mine = [e for e in robot.elements if e.link == link]
        own = [e for e in mine if e.joint is None and not e.name.endswith(("align", "unalign"))]
        if joint.kind is JointKind.FIXED:
            before = before @ still(*own)
            continue
        drive = next(e for e in mine if e.joint is not None)
        turned = still(*(e for e in mine if e.name.endswith(".align")))
        found.append(JointFrame(joint, still(*own), turned[:3, drive.axis % 3], before))
        before = np.eye(4)
    return JointFrames(tuple(found), before)


def _of_elements(robot: Robot) -> JointFrames:
    """Frames whose z axes are the joints'; constants on the driven axis are placed before it."""
    found: list[JointFrame] = []
    here, last = np.eye(4), None
    for element in robot.elements:
        step = still(element)
        if element.joint is not None:
            turn = ONTO_Z[element.axis % 3]
            found.append(JointFrame(robot.moving[element.joint], here @ step @ turn))
            here, last = turn.T, element
        elif last is not None and _commutes(element, last):
            turn = ONTO_Z[last.axis % 3]
            found[-1] = replace(found[-1], origin=found[-1].origin @ turn.T @ step @ turn)
        else:
            here, last = here @ step, None
    return JointFrames(tuple(found), here)


def _commutes(element: Element, drive: Element) -> bool:
    """Whether an element is of the same table row as a drive, and on its axis."""
    row = drive.name.split(".")[0]
    on_axis = element.matrix is None and element.axis % 3 == drive.axis % 3
    return on_axis and element.name.split(".")[0] == row and element.name.split(".")[-1] in CONSTANTS


@dataclass(frozen=True, eq=False)
class StandardDh:
    """An arm as a standard Denavit–Hartenberg table, exactly.

        T(q) = (row before) Π Rz(q + θ) Tz(d) Tx(a) Rx(α) (row behind: Rz(θ) Tz(d))

    Nearly parallel axes give a large d, as their common normal is far away; the next row compensates it.

    Args:
        rows: θ, d, a, α of each joint [rad, m].
        before: The same before the first joint; zeros where the base's z axis is the first joint's.
        behind: The same after the last one, with a = α = 0.
    """

    rows: np.ndarray
    before: np.ndarray
    behind: np.ndarray


def standard_dh(frames: JointFrames, like: np.ndarray | None = None) -> StandardDh:
    """The table of any serial arm.

    Args:
        frames: Frames of the arm; the joints' axes need not be their z axes.
        like: A nominal table: each row is the nearer one of its two solutions by θ and α; by θ = 0 if None.
    """
    turned = [_onto_axis(p, j.axis) for p, j in zip(frames.at_zero, frames.joints, strict=False)]
    places = [*turned, frames.at_zero[-1]]
    near = np.vstack([np.zeros(4), np.zeros((len(turned), 4)) if like is None else like])
    first = places[0]
    same = max(np.hypot(*first[:2, 3]), np.hypot(*first[:2, 2])) < SAME_AXIS and first[2, 2] > 0.0
    here, table = np.eye(4), [np.zeros(4)] if same else []
    for line, row in zip(places[len(table) :], near[len(table) :], strict=True):
        table.append(_row(se3.inverse(here) @ line, row[0], row[3]))
        here = here @ dh_pose(table[-1])
    left = se3.inverse(here) @ places[-1]
    behind = np.array([np.arctan2(left[1, 0], left[0, 0]), left[2, 3], 0.0, 0.0])
    return StandardDh(np.array(table[1:]), table[0], behind)


def dh_pose(row: np.ndarray) -> Matrix4:
    """Rz(θ) Tz(d) Tx(a) Rx(α)."""
    theta, d, a, alpha = row
    turn = se3.rotvec_to_matrix(Z * theta)
    return se3.pose(turn @ se3.rotvec_to_matrix(np.array([alpha, 0.0, 0.0])), turn @ np.array([a, 0.0, d]))


def _onto_axis(pose: Matrix4, axis: Vector3) -> Matrix4:
    """A frame whose z axis is a joint's."""
    if axis[2] > 1.0 - 1e-12:
        return pose
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    return pose @ se3.pose(np.column_stack([across, np.cross(axis, across), axis]), np.zeros(3))


def _row(line: Matrix4, near: float, twist: float) -> np.ndarray:
    """θ, d, a, α from a frame to the z axis of another one given in it."""
    point, z = line[:3, 3], line[:3, 2]
    sine = float(np.hypot(z[0], z[1]))
    if sine < PARALLEL:
        length = float(np.hypot(point[0], point[1]))
        theta = float(np.arctan2(point[1], point[0])) if length > 0.0 else near
        x = np.array([np.cos(theta), np.sin(theta), 0.0])
        d = 0.0
    else:
        theta = float(np.arctan2(z[0], -z[1]))
        x = np.array([-z[1], z[0], 0.0]) / sine
        # foot of the common normal on this z axis
        d = float(point[2] - (point[0] * z[0] + point[1] * z[1]) / sine**2 * z[2])
    a, alpha = float(point @ x), float(np.arctan2(np.cross(Z, z) @ x, z[2]))
    if np.cos(theta - near) + np.sin(alpha) * np.sin(twist) < 0.0:  # the other one's is the negative of it
        theta, a, alpha = theta + np.pi, -a, -alpha
    return np.array([near + (theta - near + np.pi) % (2.0 * np.pi) - np.pi, d, a, alpha])

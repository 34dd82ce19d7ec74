"""Arms whose joints count otherwise: inverted, offset, or coupled to others."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.chain import Element
from workbench.arm.conventions import CONSTANTS, DISTAL, ORDERS, followers
from workbench.arm.joint_frames import joint_frames
from workbench.arm.robot import JointKind, Robot
from workbench.arm.robot_toml import robot_from_rows, robot_to_table
from workbench.base import se3


def with_signs_and_offsets(
    robot: Robot, signs: Float[np.ndarray, " n"], offsets: Float[np.ndarray, " n"]
) -> Robot:
    """The arm whose joint positions q correspond to s q + o of another.

    Args:
        signs: s, 1 or −1.
        offsets: o [rad or m].
    """
    if not np.any(offsets) and np.all(signs > 0):
        return robot
    if robot.convention in ORDERS:
        return _of_table(robot, signs, offsets)
    joints = []
    frames = joint_frames(robot)
    for frame, sign, offset in zip(frames.joints, signs, offsets, strict=True):
        slides = frame.joint.kind is JointKind.PRISMATIC
        turn = np.eye(3) if slides else se3.rotvec_to_matrix(frame.axis * offset)
        moved = frame.origin @ se3.pose(turn, frame.axis * offset if slides else np.zeros(3))
        limited = replace(frame.joint, limits=_limits(frame.joint.limits, sign, offset))
        joints.append(replace(frame, joint=limited, origin=moved, axis=sign * frame.axis))
    return replace(frames, joints=tuple(joints)).robot(robot)


def with_couplings(robot: Robot, ratios: Float[np.ndarray, "n n"]) -> Robot:
    """The arm each of whose joints k moves by q_k and by ratios[k, j] q_j of others."""
    if not np.any(ratios):
        return robot
    if robot.urdf is not None:  # whose file can't say it
        robot = joint_frames(robot).robot(robot)
    elements, ends = list[Element](), list[int]()
    for element in robot.elements:
        elements.append(element)
        if element.joint is not None:
            row = ratios[element.joint].tolist()
            elements += followers(element, [(column, ratio) for column, ratio in enumerate(row) if ratio])
        ends.append(len(elements) - 1)
    return replace(robot, elements=tuple(elements), link_ends=tuple(ends[end] for end in robot.link_ends))


def _of_table(robot: Robot, signs: np.ndarray, offsets: np.ndarray) -> Robot:
    """The same for a table: Rz(−q) Tz(−d) = Rx(π) Rz(q) Tz(d) Rx(−π), with half-turns moved into the
    neighbouring α."""
    rows = [dict(row) for row in robot_to_table(robot)["joint"]]
    moving = [k for k, row in enumerate(rows) if row.get("type") != "fixed"]
    reverse = np.zeros(len(rows), bool)
    for k, sign, offset in zip(moving, signs, offsets, strict=True):
        row = rows[k]
        if "limits" in row:
            row["limits"] = list(_limits(row["limits"], sign, offset))
        if "follows" in row:
            columns, ratios = np.atleast_1d(row["follows"]), np.atleast_1d(row["ratio"])
            offset = offset + ratios @ offsets[columns - 1]
            row |= {"follows": columns.tolist(), "ratio": (sign * ratios * signs[columns - 1]).tolist()}
        row["d" if row.get("type") == "prismatic" else "theta"] += offset
        if sign < 0:
            row["theta"], row["d"], reverse[k] = -row["theta"], -row["d"], True
    distal = ORDERS[robot.convention] is DISTAL
    spare = {"type": "fixed", **dict.fromkeys(CONSTANTS, 0.0)}
    rows = [spare, *rows] if distal else [*rows, spare]
    before, after = np.append(reverse, False), np.append(False, reverse)
    over = before  # rows that end with a remaining half-turn, compensated by the next joint
    for row, half, turned in zip(rows, before ^ after, over, strict=True):
        row["alpha"] = float(np.pi - (np.pi - row["alpha"] - np.pi * half) % (2.0 * np.pi))
        row["beta"] *= -1.0 if turned else 1.0
        if turned and "com" in row:
            row["com"] = [row["com"][0], -row["com"][1], -row["com"][2]]
    if not spare["alpha"]:
        rows.remove(spare)
    out = robot_from_rows(rows, robot.convention, name=robot.name)
    return replace(out, mounting=robot.mounting)


def _limits(limits: Sequence[float], sign: float, offset: float) -> tuple[float, float]:
    """Minimum and maximum position in the pendant's coordinates."""
    low, high = sorted(float(sign * (v - offset)) for v in limits)
    return low, high

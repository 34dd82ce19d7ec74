"""Kinematics files of the description packages: x y z roll pitch yaw of every joint in the link before it.

    UR        ur_description         kinematics: shoulder, upper_arm, forearm, wrist_1, wrist_2, wrist_3, hash
    xArm      xarm_description       kinematics: joint1 …
    Franka    franka_description     joint1 … joint8 (the flange), each under `kinematic`

Their joints turn about their own z axes. UR and xArm have no place for what lies behind the last joint:
unless it is a rotation about that joint's axis, it is reported as a tool frame.

Sources: default_kinematics.yaml and ur_calibration of the UR ROS 2 packages; gen_kinematics_params.py of
xarm_ros2; robots/fr3/kinematics.yaml of franka_description.
"""

import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import final

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.frame import Frame
from workbench.arm.joint_frames import JointFrames, joint_frames
from workbench.arm.robot import JointKind, Robot
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.errors import FileError, OptionError
from workbench.base.toml import MAX_NUMBER
from workbench.base.types import Matrix4
from workbench.base.wording import in_mm
from workbench.data.readers.headings import number_in
from workbench.exports.export_format import AbstractForm, Job, tool_note
from workbench.identification.checks.arm_match import SAME_ARM, misfit, require_same_arm

PARTS = ("x", "y", "z", "roll", "pitch", "yaw")
NUMBERED = tuple(f"joint{k}" for k in range(1, 51))


@final
@dataclass(frozen=True)
class KinematicsYaml(AbstractForm):
    """One family of files.

    Args:
        name: What follows `--for`.
        title: What it is.
        family: Beginnings of the names of its built-in arms.
        joints: Names of the joints, as many as there may be.
        dofs: Numbers of joints that its arms have.
        head: Key above all joints; empty for none.
        inner: Key between a joint and its numbers; empty for none.
        flange: Whether a last entry holds the flange.
        hashed: Whether a hash tells the driver which arm the file belongs to.
        advice: What to know before it is used.
    """

    name: str = ""
    title: str = ""
    family: tuple[str, ...] = ()
    joints: tuple[str, ...] = NUMBERED
    dofs: tuple[int, ...] = ()
    head: str = ""
    inner: str = ""
    flange: bool = False
    hashed: bool = False
    advice: tuple[str, ...] = ()
    ending = ".yaml"

    def write(self, job: Job) -> str:
        frames, kin = self._frames(job), self._kin(job)
        if kin and _bends(job.robot) not in map(_bends, kin):
            like = f"whose joint axes lie as those of {', '.join(arm.name for arm in kin)}"
            raise OptionError(f"--for {self.name} is for arms {like}; those of '{job.robot.name}' don't")
        poses = [j.origin for j in frames.joints] + [frames.flange] * self.flange
        pad, inner = "  " * bool(self.head), "  " * bool(self.inner)
        body: list[str] = []
        for name, pose in zip(self.joints, poses, strict=False):
            values = [*pose[:3, 3], *se3.matrix_to_rpy(pose[:3, :3])]
            body += [f"{pad}{name}:", *([f"{pad}  {self.inner}:"] if self.inner else [])]
            pairs = zip(PARTS, values, strict=True)
            body += [f"{pad}{inner}  {part}: {float(v) + 0.0!r}" for part, v in pairs]
        if self.hashed:
            digest = hashlib.sha256("\n".join(body).encode()).digest()
            body.append(f"{pad}hash: calib_{int.from_bytes(digest[:8], 'big')}")
        title = f"{job.robot.name}: calibrated joint frames [m, rad], each in the link before it"
        lines = [f"# {text}" for text in (title, *self.notes(job))]
        return "\n".join([*lines, *([f"{self.head}:"] if self.head else []), *body, ""])

    def read(self, text: str, job: Job) -> Robot:
        frames = job.frames
        poses = self._poses(text, len(frames.joints) + self.flange)
        here = frames.with_origins(poses[: len(frames.joints)], poses[-1] if self.flange else np.eye(4))
        arm = here.robot(job.robot)
        return arm if self.flange else arm.with_frames(tool=self._tool(job))

    def notes(self, job: Job) -> Iterable[str]:
        yield from self.advice
        if kin := self._kin(job):
            off, name = min((misfit(job.robot, arm)[1], arm.name) for arm in kin)
            if off > SAME_ARM:
                how = "after the best base, tool and joint zeros: make sure that it is of this maker"
                yield f"'{job.robot.name}' is {in_mm(off)} off {name}, the nearest built-in one, {how}"
        if not self.flange:
            yield from tool_note(self._tool(job).pose)

    def _kin(self, job: Job) -> list[Robot]:
        """Built-in arms of the family with as many joints."""
        family = [load_robot(key) for key in built_in_robots() if key.startswith(self.family)]
        return [arm for arm in family if arm.dof == job.robot.dof]

    def _frames(self, job: Job) -> JointFrames:
        """The calibrated frames, as near as possible to those of the source, and what is left as flange."""
        frames = job.frames
        slides = [j.joint.name for j in frames.joints if j.joint.kind is JointKind.PRISMATIC]
        if len(frames.joints) not in self.dofs or slides:
            found = f"{len(frames.joints)}{f', and {slides[0]} is prismatic' if slides else ''}"
            like = f"of {' or '.join(map(str, self.dofs))} revolute joints"
            raise OptionError(f"--for {self.name} is for arms {like}; '{job.robot.name}' has {found}")
        if job.source is None:
            return self._with_last_placed(frames)
        origins = self._poses(job.source, len(frames.joints))
        theirs = frames.with_origins(origins, np.eye(4)).robot(job.robot)
        require_same_arm(job.robot, replace(theirs, name="arm of the source"))
        return frames.matched(origins)

    def _with_last_placed(self, frames: JointFrames) -> JointFrames:
        """The last joint's frame brought to the flange, as far as its own axis allows; where the file holds
        the flange, to the foot of the joint before it, where the link's mesh is."""
        *origins, last = (j.origin for j in frames.joints)
        flange, axis = frames.flange, frames.joints[-1].axis
        w, *v = se3.matrix_to_quaternion(np.eye(3) if self.flange else flange[:3, :3])
        angle = 2.0 * np.arctan2(axis @ np.array(v), w)
        along = axis @ (-last[:3, :3].T @ last[:3, 3] if self.flange else flange[:3, 3])
        move = se3.pose(se3.rotvec_to_matrix(axis * angle), axis * along)
        return frames.with_origins([*origins, last @ move], se3.inverse(move) @ flange)

    def _tool(self, job: Job) -> Frame:
        """The tool in the last frame of the file."""
        tool = job.robot.tool
        return tool if self.flange else Frame.from_pose(self._frames(job).flange @ tool.pose, tool.free)

    def _poses(self, text: str, count: int) -> list[Matrix4]:
        text, poses = re.sub(r"[ \t\r]*(?:#.*)?$", "", text, flags=re.MULTILINE), []
        for name in self.joints[:count]:
            entry = re.search(rf"^( *){name}:\n((?:(?:\1 .*)?\n)+)", f"{text}\n", re.MULTILINE)
            told = dict(re.findall(r"^ *(\w+): *(\S+)$", entry[2] if entry else "", re.MULTILINE))
            values = np.array([number_in(told.get(part, "")) for part in PARTS])
            if not (np.abs(values) < MAX_NUMBER).all():
                text = f"has no numbers x, y, z, roll, pitch, yaw for '{name}'; give a {self.title}"
                raise FileError(text, path=f"the {self.name} file")
            poses.append(se3.pose(se3.rpy_to_matrix(values[3:]), values[:3]))
        return poses


def _bends(robot: Robot) -> list[bool]:
    """Whether each joint's axis is rather parallel to the one before it."""
    pairs = pairwise(joint_frames(robot).joints)
    return [abs(a.axis @ (b.before @ b.origin)[:3, :3] @ b.axis) > 0.5 for a, b in pairs]


UR = KinematicsYaml(
    name="ur-kinematics",
    title="kinematics file of ur_description (kinematics_params_file)",
    family=("ur",),
    joints=("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"),
    dofs=(6,),
    head="kinematics",
    hashed=True,
    advice=(
        "the driver compares the hash with the controller's and warns if they differ; to avoid this, use "
        "the hash in the file that ur_calibration read from this arm",
        "frames are those of base_link_inertia, the controller's base",
    ),
)
XARM = replace(
    UR,
    name="xarm-kinematics",
    title="kinematics file of xarm_description (kinematics_suffix)",
    family=("xarm",),
    joints=NUMBERED,
    dofs=(5, 6, 7),
    hashed=False,
    advice=("save it as user/xarm6_kinematics_SUFFIX.yaml, with the model's name, for kinematics_suffix",),
)
FRANKA = KinematicsYaml(
    name="franka-kinematics",
    title="kinematics.yaml of franka_description",
    family=("panda", "fr3"),
    dofs=(7,),
    inner="kinematic",
    flange=True,
)

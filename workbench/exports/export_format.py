"""Export formats of a calibration for controllers, drivers and programs: one file each.

A form writes a text and reads it back as the arm that a consumer of the file would compute. That arm is
compared with the calibrated one over the measured poses (or some within the limits, where the arm's file has
none), so that the error due to whatever a form can't represent is measured on the written file itself.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from workbench.arm.built_in_arms import refusal, refuse_xacro
from workbench.arm.calibrated_region import region_text
from workbench.arm.effects import AbstractEffect
from workbench.arm.joint_frames import JointFrames, joint_frames
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import NO_DIFFERENCE, PoseErrors, away_text, divided, nominal_arm, usable_arm
from workbench.base import se3
from workbench.base.errors import OptionError, understood
from workbench.base.files import read_bytes, write_text
from workbench.base.types import Matrix4
from workbench.identification.checks.arm_match import require_same_arm

COMPARED_POSES = 500
"""Poses over which a file is compared with the calibration."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """What is to be written.

    Args:
        robot: The calibrated arm.
        nominal: The arm as its controller computes it; None if not given.
        source: Text of a file of this form that is to be brought up to date; None for a new one.
        before: The calibrated arm with its constants as they were before; None if nobody says.
    """

    robot: Robot
    nominal: Robot | None = None
    source: str | None = None
    before: Robot | None = None

    @cached_property
    def frames(self) -> JointFrames:
        return joint_frames(self.robot)

    def required(self, arm: Robot | None, form: str, what: str) -> Robot:
        """The nominal arm, or that before its calibration; refused if nobody says."""
        if arm is None:
            raise OptionError(f"--for {form} needs --nominal ROBOT, the model {what}", option="--nominal")
        return arm


class AbstractForm(ABC):
    """One form. `write` and `read` have no default."""

    name: str
    """What follows `--for`."""
    title: str
    """What it is, for a list."""
    ending: ClassVar[str]
    """Usual ending of its files."""
    needs_source: ClassVar[bool] = False
    """Whether it only updates a file that exists."""
    dofs: tuple[int, ...] = ()
    """Numbers of joints that its arms have; empty: any."""

    def refusal(self, robot: Robot) -> str:
        """Why a file of a calibrated arm should not be used, as its TOML or its URDF; empty if it may."""
        return refusal(robot, ".urdf")

    def text_of(self, path: Path) -> str:
        refuse_xacro(path)
        return read_bytes(path, wanted=f"a file for --for {self.name}").decode(errors="replace")

    @abstractmethod
    def write(self, job: Job) -> str:
        """Contents of the file."""

    @abstractmethod
    def read(self, text: str, job: Job) -> Robot:
        """The arm as whoever loads the file computes it, in its own base, up to its flange."""

    def notes(self, job: Job) -> Iterable[str]:
        """Notes on using the file, one sentence each."""
        return ()


@dataclass(frozen=True, eq=False, kw_only=True)
class Exported:
    """A file that was written.

    Args:
        path: Where.
        position: Maximum distance of the file's tool from that of the calibrated arm [m].
        rotation: Maximum angle [rad].
        verdict: The same in words, and the error of the file's arm.
        rows: Poses that were compared.
        notes: What to know before it is used.
    """

    path: Path
    position: float
    rotation: float
    verdict: str
    rows: int
    notes: tuple[str, ...]


def export_robot(form: AbstractForm, path: Path | str, job: Job, *, rows: int = COMPARED_POSES) -> Exported:
    """Write a calibration in a form, and say how much of it the file holds.

    Args:
        path: File to write.
        rows: Poses to compare.
    """
    calibrated, whole, carried = job.robot, usable_arm(job.robot), usable_arm(job.robot, effects=False)
    if job.nominal is not None:
        require_same_arm(whole.robot, job.nominal)
    job = replace(job, robot=carried.robot.in_first_session, before=_before(job))
    with understood(f"a file for --for {form.name}", "--into") if job.source else nullcontext():
        text = form.write(job)
        read = form.read(text, job)
    notes = [*region_text(calibrated), *carried.notes, *form.notes(job)]
    known, unknown = divided(whole.robot)
    q = whole.q[:rows]
    arms = whole.calibrated, read.with_frames(base=job.robot.base)
    left = PoseErrors.of(se3.pose_error(*(tool_poses(arm, Motion(q)) for arm in arms)))
    if known:
        notes.append(f"can't hold the effects {_names(known)}; the figure above includes the error")
    if unknown:
        notes.append(f"can't hold {_names(unknown)}, which the figure above does not include")
    same = f"the file agrees with the calibrated model to {NO_DIFFERENCE:g} m and rad at {len(q)} poses"
    return Exported(
        path=write_text(path, text),
        position=left.position_max,
        rotation=left.rotation_max,
        verdict=next(iter(away_text("file", calibrated, left, len(q), effects=False)), same),
        rows=len(q),
        notes=tuple(dict.fromkeys(notes)),
    )


def _before(job: Job) -> Robot | None:
    """The arm before its calibration: by its record, or the nominal arm if it has the same constants."""
    if job.robot.calibration is not None:
        return nominal_arm(job.robot)
    other = job.nominal
    same = other is not None and [e.name for e in other.elements] == [e.name for e in job.robot.elements]
    return other if same else None


def tool_note(tool: Matrix4) -> Iterable[str]:
    """What to enter as the tool where a form ends before it; nothing if that is nothing."""
    if not np.allclose(tool, np.eye(4), atol=1e-12):
        yield f"enter the tool frame (TCP) {pose_text(tool)}: the file has no place for it"


def pose_text(pose: Matrix4) -> str:
    xyz = ", ".join(f"{1e3 * v:.4f}" for v in pose[:3, 3])
    turn = ", ".join(f"{v:.7f}" for v in se3.matrix_to_rotvec(pose[:3, :3]))
    return f"{xyz} mm, rotation vector {turn} rad"


def _names(effects: Iterable[AbstractEffect]) -> str:
    return ", ".join(dict.fromkeys(str(e.name) for e in effects))

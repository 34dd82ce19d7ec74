"""Guided measuring: which sample is stored for which target, and why one is refused.

Somebody steers the arm to the target and asks for the sample to be kept (ARIA 5.1). Stored with its joints is
the pose that the source measures; where it measures none, the target's own pose, which the plate's seat
imposes. One run stores one of the two, never a mix.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.types import Matrix4, Poses, Vector3
from workbench.data.dataset import Dataset
from workbench.extras.live.sample import Sample
from workbench.extras.live.standstill import JOINT_STILL, ArmState
from workbench.plate.plate import Kind, Plate

MAX_DISTANCE, MAX_ANGLE = 0.03, float(np.deg2rad(5.0))
"""A tool further than this from its target [m], [rad] is at none, or at another one."""
ROUGH, CLEARER = 6.0, 2.0
"""Where only the nominal arm tells: how many times further the tool may be, and how many times nearer another
target must be."""


def name_of(target: int) -> str:
    """Of a target of the plate, counted from 0."""
    return f"target {target + 1}"


@dataclass(frozen=True)
class TargetPlace:
    """Where the tool stands among the targets.

    Args:
        is_known: Whether a row may be stored for the current target.
        text: How far it is off, where it is more than it may; else empty.
        advice: At which target it stands instead, if it clearly does.
    """

    is_known: bool = True
    text: str = ""
    advice: str = "The tool is not at a target."


@dataclass(frozen=True, eq=False, kw_only=True)
class Acquisition:
    """Targets, the newest sample, and the rows stored so far.

    Args:
        plate: Its targets are taken in their order.
        robot: Nominal arm: where the source measures no pose, it says where the tool should be.
        rows: Stored samples by the index of their target, the last one last.
        current: Index of the target that the next row belongs to.
        latest: Newest sample; None before the first.
        arm_state: Whether the arm stood still then.
        silence: Time since the source said anything [s]; 0 where that is no matter.
        is_measured: Whether measured poses are stored; settled by the first row.
        message: Outcome of the last request.
    """

    plate: Plate
    robot: Robot
    rows: Mapping[int, Sample] = field(default_factory=lambda: MappingProxyType({}))
    current: int = 0
    latest: Sample | None = None
    arm_state: ArmState = ArmState.UNKNOWN
    silence: float = 0.0
    is_measured: bool = False
    message: str = ""

    @cached_property
    def poses(self) -> Poses:
        """Of the tool at the targets, in the frame that the source measures in."""
        return self.robot.base.pose @ self.plate.poses

    @property
    def pose(self) -> Matrix4:
        """Of the tool at the current target."""
        return self.poses[self.current]

    @property
    def is_done(self) -> bool:
        """Whether every target has its row."""
        return len(self.rows) == len(self.plate)

    def with_sample(self, sample: Sample, arm_state: ArmState) -> "Acquisition":
        """With a newer sample, which is stored if it asks for that."""
        is_measured = self.is_measured or (not self.rows and sample.position is not None)
        now = replace(self, latest=sample, arm_state=arm_state, silence=0.0, is_measured=is_measured)
        if not sample.capture or self.is_done:
            return now
        try:
            return now.stored()
        except DataError as error:
            return replace(now, message=str(error))

    def stored(self) -> "Acquisition":
        """With the latest sample as the row of the current target."""
        sample, place, current = self._storable(), self.place(), self.current
        if not place.is_known:
            raise DataError(f"not stored: the tool is {place.text}. {place.advice}")
        if not self.is_measured:
            turn = self.pose[:3, :3] if self.plate.targets[current].kind is Kind.SEAT else None
            sample = replace(sample, position=self.pose[:3, 3], rotation=turn)
        rows = {i: row for i, row in self.rows.items() if i != current} | {current: sample}
        after = (*range(current + 1, len(self.plate)), *range(current))
        doubts = [] if self.arm_state is ArmState.STILL else [f"the arm {self.arm_state}"]
        doubts += [f"the tool is {place.text}"] if place.text else []
        return replace(
            self,
            rows=MappingProxyType(rows),
            current=next((i for i in after if i not in rows), current),
            message=f"{name_of(current)} stored" + (f" ({'; '.join(doubts)})" if doubts else ""),
        )

    def _storable(self) -> Sample:
        """The latest sample, if it may be stored now."""
        sample, last = self.latest, [*self.rows][-1] if self.rows else None
        if sample is None:
            raise DataError("not stored: no sample has come from the source yet")
        reason = ""
        if self.silence > 0.0:
            reason = f"the source has been silent for {self.silence:.0f} s"
        elif self.is_done and self.current == last:
            reason = "every target has its row; retake the last one to replace it"
        elif self.is_measured and sample.position is None:
            reason = "the instrument does not see the tool"
        elif self.arm_state is ArmState.MOVING:
            reason = f"the arm {self.arm_state}; wait"
        elif last is not None and np.abs(sample.q - self.rows[last].q).max() <= JOINT_STILL:
            reason = "the arm has not moved since the last row; move it on"
        if reason:
            raise DataError(f"not stored: {reason}")
        return sample

    def again(self) -> "Acquisition":
        """Without the row of the current target, or else the last one; its target is current."""
        if not self.rows:
            raise DataError("there is no row to retake; store one first")
        index = self.current if self.current in self.rows else [*self.rows][-1]
        rows = MappingProxyType({i: row for i, row in self.rows.items() if i != index})
        message = f"{name_of(index)}: its row was discarded; measure it again"
        return replace(self, rows=rows, current=index, message=message)

    def next(self, by: int = 1) -> "Acquisition":
        """Another target is current, counted from the present one and around."""
        current = (self.current + by) % len(self.plate)
        has_row = " has a row, which the next replaces" if current in self.rows else ""
        return replace(self, current=current, message=f"{name_of(current)}{has_row}")

    def dataset(self, *, source: str) -> Dataset:
        """What is stored, in the order of the targets; a target's name is its group."""
        kept = dict(sorted(self.rows.items()))
        turns = [row.rotation for row in kept.values() if row.rotation is not None]
        notes = [] if self.is_done else [f"{len(kept)} of {len(self.plate)} targets were measured"]
        if 0 < len(turns) < len(kept):
            notes.append("orientations are left out, as some rows have none")
        owner = "the source" if self.is_measured else "the targets, as the source measures none"
        return Dataset(
            q=np.stack([row.q for row in kept.values()]),
            row=np.array([*kept]),
            position=np.stack([row.position for row in kept.values() if row.position is not None]),
            rotation=np.stack(turns) if len(turns) == len(kept) else None,
            time=np.array([row.time for row in kept.values()]),
            group=np.array([name_of(i) for i in kept], dtype=str),
            source=source,
            notes=(*notes, f"stored with the joints: poses of {owner}"),
        )

    def deviation(self) -> tuple[Vector3 | None, Vector3 | None]:
        """Position [m] and rotation vector [rad] of the tool less the target's; None where unknown."""
        pose, is_oriented = self._pose()
        if pose is None:
            return None, None
        error = se3.pose_error(pose, self.pose)
        return error[:3], error[3:] if is_oriented else None

    def place(self) -> TargetPlace:
        """Where the tool stands among the targets.

        The measured pose decides wherever it is at a target. Else, as where nothing is measured or by an
        instrument in a frame of its own, the nominal arm does: what is clearly nearer to it, as its own
        errors may be large.
        """
        if self.latest is None:
            return TargetPlace()
        expected, (pose, is_oriented) = self._nominal(self.latest), self._pose()
        if pose is None:
            pose, is_oriented = expected, True
        seen = self._distances(pose, is_oriented)
        if seen[self.current] <= 1.0:
            return TargetPlace()
        is_decided = self.is_measured and seen.min() <= 1.0
        off, limit = (seen, 1.0) if is_decided else (self._distances(expected, True), ROUGH)
        nearest, own = int(np.argmin(off)), off[self.current]
        is_other = bool(off[nearest] * CLEARER < own > 1.0)
        error = se3.pose_error(pose, self.pose)
        angle = f" and {np.rad2deg(np.linalg.norm(error[3:])):.1f}°" if is_oriented else ""
        text = f"{1e3 * np.linalg.norm(error[:3]):.1f} mm{angle} from {name_of(self.current)}"
        if is_other:
            return TargetPlace(False, text, f"This looks like {name_of(nearest)}: go to that one.")
        return TargetPlace(bool(own <= limit), text)

    def _distances(self, pose: Matrix4, is_oriented: bool) -> Float[np.ndarray, " targets"]:
        """From a pose to every target, in multiples of what it may be off."""
        error = se3.pose_error(np.broadcast_to(pose, self.poses.shape), self.poses)
        off = np.linalg.norm(error[:, :3], axis=1) / MAX_DISTANCE
        turned = np.linalg.norm(error[:, 3:], axis=1) / MAX_ANGLE
        is_imposed = np.array([target.kind is Kind.SEAT for target in self.plate.targets])
        return np.where(is_oriented & is_imposed, np.maximum(off, turned), off)

    def _nominal(self, sample: Sample) -> Matrix4:
        return tool_poses(self.robot, Motion(sample.q[None]))[0]

    def _pose(self) -> tuple[Matrix4 | None, bool]:
        """Pose of the tool, measured or by the nominal model, and whether it has an orientation."""
        sample = self.latest
        if sample is not None and not self.is_measured:
            return self._nominal(sample), True
        if sample is None or sample.position is None:
            return None, False
        turn = np.eye(3) if sample.rotation is None else sample.rotation
        return se3.pose(turn, sample.position), sample.rotation is not None

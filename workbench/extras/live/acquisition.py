"""Guided measuring: which sample is stored for which target, and why one is refused. Knows no terminal.

Somebody steers the arm to the target and asks for the sample to be kept (ARIA 5.1). Stored with its joints is
the pose that the source measures; where it measures none, the target's own pose, which the plate's seat
imposes. One run stores one of the two, never a mix.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.types import Matrix4, Vector3, frozen
from workbench.data.dataset import Dataset
from workbench.extras.live.sample import Sample
from workbench.extras.live.standstill import ArmState, StandstillDetector
from workbench.plate.plate import Kind, Plate

THINNED = 0.02
"""Samples that follow the last one sooner than this are not looked at for motion [s]."""
MAX_DISTANCE, MAX_ANGLE = 0.03, float(np.deg2rad(5.0))
"""A tool further than this from its target [m], [rad] is at none, or at another one."""
NEAR, ALIGNED = 5e-3, float(np.deg2rad(1.0))
"""A tool nearer than this is shown in green [m], [rad]."""
ROUGH, CLEARER = 6.0, 2.0
"""Where only the nominal arm tells: how many times further the tool may be, and how many times nearer another
target must be."""


class PoseSource(StrEnum):
    """Where the stored poses come from."""

    MEASURED = "the pose measured by the source"
    REFERENCE = "the pose of the target, as the source measures none"


@dataclass(frozen=True)
class Event:
    """The result of a request: one sentence, and whether the stored rows have changed."""

    message: str
    changed: bool = False


@dataclass(frozen=True, eq=False)
class CaptureTarget:
    """A pose to be measured.

    Args:
        name: Name of the target.
        pose: Pose of the tool, in the frame that the source measures in.
        is_oriented: Whether its orientation is imposed as well.
    """

    name: str
    pose: Float[np.ndarray, "4 4"]
    is_oriented: bool = True


def plate_targets(
    robot: Robot, plate: Plate, numbers: Sequence[int] | None = None
) -> tuple[CaptureTarget, ...]:
    """The targets of a plate, or some of them, as poses in the measuring frame."""
    if not len(plate):
        raise OptionError(f"plate '{plate.name}' has no targets to measure; add [[target]] tables")
    chosen = ((i, plate.targets[i]) for i in (range(len(plate)) if numbers is None else numbers))
    return tuple(
        CaptureTarget(f"target {i + 1}", frozen(robot.base.pose @ target.pose), target.kind is Kind.SEAT)
        for i, target in chosen
    )


@dataclass(frozen=True)
class TargetPlace:
    """Where the tool stands among the targets.

    Args:
        looks_like: Index of the target at which it stands instead, if it clearly does.
        is_known: Whether a row may be stored for the current target.
        text: How far it is off, where it is more than it may; else empty.
    """

    looks_like: int | None = None
    is_known: bool = True
    text: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class Status:
    """All that a view shows, at one time.

    Args:
        name: Name of the current target.
        stored: For each target, whether a row is stored.
        target: The current target's pose in the measuring frame.
        position: Of the tool, measured or by the nominal model, minus the target's [m]; None where unknown.
        rotation: Rotation vector from target to tool, same axes [rad]; None where unknown.
        place: Where the tool stands among the targets.
        is_measured: Whether the pose is measured; else it comes from the nominal model.
        arm_state: Whether the arm stands still; None before the first sample.
        silence: Time since the last sample came [s].
        message: Outcome of the last request.
    """

    name: str
    stored: tuple[bool, ...]
    target: Matrix4
    position: Vector3 | None
    rotation: Vector3 | None
    place: TargetPlace
    is_measured: bool
    arm_state: ArmState | None
    silence: float
    message: str


@final
class Acquisition:
    """Takes samples and requests, stores rows.

    Args:
        targets: In the order in which they are taken, in the measuring frame.
        robot: Nominal arm: where the source measures no pose, it says where the tool should be.
        detector: Judges standstill; the usual tolerances if None.
        session: Name of the placement of robot and instrument.
    """

    def __init__(
        self,
        targets: tuple[CaptureTarget, ...],
        *,
        robot: Robot,
        detector: StandstillDetector | None = None,
        session: str = "",
    ):
        self.targets = targets
        self.taken: tuple[Sample | None, ...] = (None,) * len(targets)
        self.current = 0
        self.latest: Sample | None = None
        self.arm_state: ArmState | None = None
        self.silence = 0.0
        self.message = ""
        self._robot, self._session = robot, session
        self._detector = detector or StandstillDetector()
        self._judged: Sample | None = None
        self._order: list[int] = []
        self._source: PoseSource | None = None
        self._is_measured = False

    def copy(self) -> "Acquisition":
        """One that goes on by itself and leaves this one as it is."""
        other = copy.copy(self)
        other._detector = self._detector.copy()
        return other

    @property
    def target(self) -> CaptureTarget:
        """The one that the next row belongs to."""
        return self.targets[self.current]

    @property
    def is_done(self) -> bool:
        """Whether every target has its row."""
        return len(self._order) == len(self.targets)

    @property
    def source(self) -> PoseSource:
        """Where the stored poses come from; settled by the first row."""
        return self._source or (PoseSource.MEASURED if self._is_measured else PoseSource.REFERENCE)

    @property
    def judged(self) -> tuple[Sample, ...]:
        """The samples by which standstill is judged at present."""
        return self._detector.seen

    @property
    def rows(self) -> int:
        """Number of rows stored."""
        return len(self._order)

    def update(self, sample: Sample) -> Event | None:
        """Take in a sample; what came of it if the sample itself asks to be stored."""
        self.latest, self.silence = sample, 0.0
        self._is_measured = self._is_measured or sample.position is not None
        if self._judged is None or sample.capture or not 0.0 <= sample.time - self._judged.time < THINNED:
            self.arm_state = self._judge(sample)
            self._judged = sample
        return self.store() if sample.capture and not self.is_done else None

    def _judge(self, sample: Sample) -> ArmState:
        if self._detector.update(sample):
            return ArmState.STILL
        last = -np.inf if self._judged is None else self._judged.time
        seldom = sample.time - last > max(self._detector.window / 2.0, 3.0 * THINNED)
        return ArmState.UNKNOWN if seldom else ArmState.MOVING

    def store(self, *, force: bool = False, anywhere: bool = False) -> Event:
        """Store the latest sample for the current target, or say why not.

        Args:
            force: Also while the arm moves, or has not moved since the last row.
            anywhere: Also where the tool is not at the target.
        """
        sample, index, place = self.latest, self.current, self.place()
        reason = "no sample has come from the source yet" if sample is None else self._refusal(sample, force)
        if not reason and not place.is_known and not anywhere:
            reason = f"the tool is {place.text}"
            if place.looks_like is not None:
                name = self.targets[place.looks_like].name
                reason += f"; this looks like {name}: store it as {name}?"
        if reason or sample is None:
            return self._say(f"not stored: {reason}")
        self._source = self.source
        self.taken = (*self.taken[:index], self._completed(sample), *self.taken[index + 1 :])
        self._order = [*(i for i in self._order if i != index), index]
        after = (*range(index + 1, len(self.targets)), *range(index))
        self.current = next((i for i in after if self.taken[i] is None), index)
        doubts = [] if self.arm_state is ArmState.STILL else [f"the arm {self.arm_state}"]
        doubts += [f"the tool is {place.text}"] if place.text else []
        doubt = f" ({'; '.join(doubts)})" if doubts else ""
        end = "; that was the last one" if self.is_done else ""
        return self._say(f"{self.targets[index].name} stored{doubt}{end}", changed=True)

    def store_as(self, index: int) -> Event:
        """Make the target current at which the tool stands, and store the latest sample for it."""
        before, self.current = self.current, index
        event = self.store()
        if not event.changed:
            self.current = before
        return event

    def place(self) -> TargetPlace:
        """Where the tool stands among the targets.

        The measured pose decides wherever it is at a target. Where it is at none, as with an instrument in a
        frame of its own, the nominal arm does; and where nothing is measured, what is clearly nearer to it,
        as its own errors may be large.
        """
        sample, current = self.latest, self.current
        if sample is None:
            return TargetPlace()
        pose, is_oriented = self._where()
        expected = tool_poses(self._robot, Motion(sample.q[None]))[0]
        by_joints = self._distances(expected, is_oriented=True)
        if not self._is_measured or pose is None:
            nearest, own = int(np.argmin(by_joints)), by_joints[current]
            is_other = by_joints[nearest] * CLEARER < own > 1.0
            is_known = not is_other and own <= ROUGH
            return self._place(own, expected, True, is_known, nearest if is_other else None)
        seen = self._distances(pose, is_oriented=is_oriented)
        by_pose = seen if seen.min() <= 1.0 else by_joints
        nearest, is_known = int(np.argmin(by_pose)), bool(by_pose[current] <= 1.0)
        is_other = by_pose[nearest] <= 1.0 and not is_known
        return self._place(seen[current], pose, is_oriented, is_known, nearest if is_other else None)

    def _place(
        self, off: float, pose: Matrix4, is_oriented: bool, is_known: bool, looks_like: int | None
    ) -> TargetPlace:
        if off <= 1.0:
            return TargetPlace()
        error = se3.pose_error(pose, self.target.pose)
        angle = f" and {np.rad2deg(np.linalg.norm(error[3:])):.1f}°" if is_oriented else ""
        text = f"{1e3 * np.linalg.norm(error[:3]):.1f} mm{angle} from {self.target.name}"
        return TargetPlace(looks_like, is_known, text)

    def _distances(self, pose: Matrix4, *, is_oriented: bool) -> np.ndarray:
        """From a pose to every target, in multiples of what it may be off."""
        poses = np.stack([target.pose for target in self.targets])
        error = se3.pose_error(np.broadcast_to(pose, poses.shape), poses)
        off = np.linalg.norm(error[:, :3], axis=1) / MAX_DISTANCE
        turned = np.linalg.norm(error[:, 3:], axis=1) / MAX_ANGLE
        is_imposed = np.array([target.is_oriented for target in self.targets])
        return np.where(is_oriented & is_imposed, np.maximum(off, turned), off)

    def _refusal(self, sample: Sample, force: bool) -> str | None:
        """Why the sample can't be stored now; None if it can."""
        if self.silence > 0.0:
            return f"the source has been silent for {self.silence:.0f} s"
        if self._order and self.is_done and self.current == self._order[-1]:
            return "every target has its row; retake the last one to replace it"
        if self.source is PoseSource.MEASURED and sample.position is None:
            return "the instrument does not see the tool"
        if force:
            return None
        if self.arm_state is ArmState.MOVING:
            return f"the arm {self.arm_state}; wait, or force it"
        last = self.taken[self._order[-1]] if self._order else None
        if last is not None and np.abs(sample.q - last.q).max() <= self._detector.joint:
            return "the arm has not moved since the last row; move it on, or force it"
        return None

    def _completed(self, sample: Sample) -> Sample:
        """The sample with the pose that is to be stored with it."""
        if self.source is PoseSource.MEASURED:
            return sample
        pose = self.target.pose
        return replace(
            sample, position=pose[:3, 3], rotation=pose[:3, :3] if self.target.is_oriented else None
        )

    def again(self) -> Event:
        """Drop the row of the current target, or else the one that was stored last; its target is current."""
        if not self._order:
            return self._say("there is no row to retake")
        index = self.current if self.taken[self.current] is not None else self._order[-1]
        self._order = [i for i in self._order if i != index]
        self.taken = (*self.taken[:index], None, *self.taken[index + 1 :])
        self.current = index
        return self._say(f"{self.target.name}: its row was discarded; measure it again", changed=True)

    def step(self, by: int) -> Event:
        """Make another target current, counted from the present one and around."""
        self.current = (self.current + by) % len(self.targets)
        is_stored = self.taken[self.current] is not None
        return self._say(self.target.name + (" has a row, which the next replaces" if is_stored else ""))

    def dataset(self, *, source: str) -> Dataset:
        """What is stored, in the order of the targets; a target's name is its group."""
        rows = [(i, sample) for i, sample in enumerate(self.taken) if sample is not None]
        if not rows:
            raise DataError(f"{source}: nothing has been stored yet")
        kept = [sample for _, sample in rows]
        turns = [sample.rotation for sample in kept if sample.rotation is not None]
        notes = [] if self.is_done else [f"{len(kept)} of {len(self.targets)} targets were measured"]
        if 0 < len(turns) < len(kept):
            notes.append("orientations are left out, as some rows have none")
        return Dataset(
            q=np.stack([sample.q for sample in kept]),
            row=np.array([i for i, _ in rows]),
            position=np.stack([sample.position for sample in kept if sample.position is not None]),
            rotation=np.stack(turns) if len(turns) == len(kept) else None,
            time=np.array([sample.time for sample in kept]),
            group=np.array([self.targets[i].name for i, _ in rows], dtype=str),
            session=np.full(len(kept), self._session) if self._session else None,
            source=source,
            notes=(*notes, f"stored with the joints: {self.source}"),
        )

    def status(self) -> Status:
        """All that a view shows."""
        pose, is_oriented = self._where()
        off = None if pose is None else se3.pose_error(pose, self.target.pose)
        return Status(
            name=self.target.name,
            stored=tuple(sample is not None for sample in self.taken),
            target=self.target.pose,
            position=None if off is None else off[:3],
            rotation=off[3:] if off is not None and is_oriented else None,
            place=self.place(),
            is_measured=self._is_measured,
            arm_state=self.arm_state,
            silence=self.silence,
            message=self.message,
        )

    def _where(self) -> tuple[Matrix4 | None, bool]:
        """Pose of the tool, measured or by the nominal model, and whether it has an orientation."""
        sample = self.latest
        if sample is None:
            return None, False
        if not self._is_measured:
            return tool_poses(self._robot, Motion(sample.q[None]))[0], True
        if sample.position is None:
            return None, False
        turn = np.eye(3) if sample.rotation is None else sample.rotation
        return se3.pose(turn, sample.position), sample.rotation is not None

    def _say(self, message: str, *, changed: bool = False) -> Event:
        self.message = message
        return Event(message, changed)

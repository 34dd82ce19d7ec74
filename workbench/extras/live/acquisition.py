"""Guided measuring: which sample is stored for which target, and why one is refused. Knows no terminal.

Somebody steers the arm to the target and asks for the sample to be kept (ARIA 5.1). Stored with its joints is
the pose that the source measures; where it measures none, the target's own pose, which the plate's seat
imposes. One run stores one of the two, never a mix.
"""

import copy
from collections import deque
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import final

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import Matrix4, Vector3
from workbench.data.dataset import Dataset
from workbench.extras.live.capture import CaptureProgress
from workbench.extras.live.sample import Sample

THINNED = 0.02
"""Samples that follow the last one sooner than this are not looked at for motion [s]."""
POSITION_STILL = 1e-3
"""Maximum range of positions that a noisy instrument measures of an arm that stands still [m]."""
ORIENTATION_STILL = float(np.deg2rad(0.2))
"""Likewise of orientations [rad]; the joints decide more sharply."""
MAX_DISTANCE, MAX_ANGLE = 0.03, float(np.deg2rad(5.0))
"""A tool further than this from its target [m], [rad] is at none, or at another one."""
NEAR, ALIGNED = 5e-3, float(np.deg2rad(1.0))
"""A tool nearer than this is shown in green [m], [rad]."""
ROUGH, CLEARER = 6.0, 2.0
"""Where only the nominal arm tells: how many times further the tool may be, and how many times nearer another
target must be."""


@final
class StandstillDetector:
    """Decides from the samples of the last window whether the arm stands still.

    Args:
        window: Time that the arm must have stood [s].
        joint: Largest range of any joint [rad or m].
        position: Largest distance of two measured positions' extremes [m].
        orientation: Largest angle from the window's first orientation [rad].
    """

    def __init__(
        self, *, window: float = 0.5, joint: float = 2e-4, position: float = 1e-4, orientation: float = 5e-4
    ):
        for name, value in (
            ("window", window),
            ("joint", joint),
            ("position", position),
            ("orientation", orientation),
        ):
            if not value > 0.0:
                raise OptionError(f"standstill {name} must be above 0, got {value:g}")
        self.window = window
        self.joint = joint
        self.position = position
        self.orientation = orientation
        self._seen: deque[Sample] = deque()

    def update(self, sample: Sample) -> bool:
        """Take in a sample; True when all samples of the last window are alike and span it.

        A step back in time (the source was restarted), another number of joints, or a pose that comes or
        goes begins a new window.
        """
        if self._seen and not continues(self._seen[-1], sample):
            self._seen.clear()
        self._seen.append(sample)
        while len(self._seen) > 1 and sample.time - self._seen[1].time >= self.window:
            self._seen.popleft()
        return sample.time - self._seen[0].time >= self.window and self._alike()

    @property
    def seen(self) -> tuple[Sample, ...]:
        """The samples of the last window."""
        return tuple(self._seen)

    def copy(self) -> "StandstillDetector":
        """One with the same tolerances and the same memory, which goes on by itself."""
        other = copy.copy(self)
        other._seen = self._seen.copy()
        return other

    def _alike(self) -> bool:
        q = np.stack([sample.q for sample in self._seen])
        if np.ptp(q, axis=0).max() > self.joint:
            return False
        points = [sample.position for sample in self._seen if sample.position is not None]
        if points and np.linalg.norm(np.ptp(np.stack(points), axis=0)) > self.position:
            return False
        turns = [sample.rotation for sample in self._seen if sample.rotation is not None]
        if not turns:
            return True
        away = se3.matrix_to_rotvec(np.stack(turns) @ turns[0].T)
        return bool(np.linalg.norm(away, axis=-1).max() <= self.orientation)


def continues(last: Sample, sample: Sample) -> bool:
    """Whether a sample follows the last one in the same stream."""
    return (
        sample.time > last.time
        and len(sample.q) == len(last.q)
        and (sample.position is None) == (last.position is None)
        and (sample.rotation is None) == (last.rotation is None)
    )


class ArmState(StrEnum):
    """Whether the arm stands still."""

    STILL = "stands still"
    MOVING = "is moving, or has only just stopped"
    UNKNOWN = "may be moving: samples are too far apart to be sure"


class PoseSource(StrEnum):
    """Where the stored poses come from."""

    MEASURED = "the pose measured by the source"
    REFERENCE = "the pose of the target, as the source measures none"


@dataclass(frozen=True)
class Event:
    """The result of a request: one sentence, and whether the stored rows have changed."""

    message: str
    changed: bool = False


@dataclass(frozen=True)
class TargetPlace:
    """Where the tool stands among the targets.

    Args:
        off: Distance from the current target, as a multiple of `MAX_DISTANCE` or `MAX_ANGLE`; NaN where the
            target is no pose, or nothing tells.
        looks_like: Index of the target at which it stands instead, if it clearly does.
        is_known: Whether a row may be stored for the current target.
        text: How far it is off, where it is more than it may; else empty.
    """

    off: float = np.nan
    looks_like: int | None = None
    is_known: bool = True
    text: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class Status:
    """All that a view shows, at one time.

    Args:
        name: Name of the current target.
        current: Its index.
        stored: For each target, whether a row is stored.
        target: The target's pose in the measuring frame; None: any.
        pose: Where the tool is, measured or from the nominal model; None before the first sample.
        position: Pose minus target, axes of the measuring frame [m]; None where one is missing.
        rotation: Rotation vector from target to pose, same axes [rad]; None where one is missing.
        place: Where the tool stands among the targets.
        measured: Whether the pose is measured; else it comes from the nominal model.
        arm_state: Whether the arm stands still; None before the first sample.
        source: Where the stored poses come from.
        silence: Time since the last sample came [s].
        message: Outcome of the last request.
    """

    name: str
    current: int
    stored: tuple[bool, ...]
    target: Matrix4 | None
    pose: Matrix4 | None
    position: Vector3 | None
    rotation: Vector3 | None
    place: TargetPlace
    measured: bool
    arm_state: ArmState | None
    source: PoseSource
    silence: float
    message: str


@final
class Acquisition:
    """Takes samples and requests, stores rows.

    Args:
        capture: The targets, in the measuring frame.
        robot: Nominal arm: where the source measures no pose, it says where the tool should be.
        detector: Judges standstill; the usual tolerances if None.
        oriented: For each target, whether its orientation is imposed as well; all if None.
        forced: Store on the source's request even while the arm moves.
    """

    def __init__(
        self,
        capture: CaptureProgress,
        *,
        robot: Robot,
        detector: StandstillDetector | None = None,
        oriented: tuple[bool, ...] | None = None,
        forced: bool = False,
    ):
        self.capture = capture
        self.latest: Sample | None = None
        self.arm_state: ArmState | None = None
        self.silence = 0.0
        self.message = ""
        self._robot = robot
        self._detector = detector or StandstillDetector(
            position=POSITION_STILL, orientation=ORIENTATION_STILL
        )
        self._oriented = oriented or (True,) * len(capture.targets)
        self._forced = forced
        self._judged: Sample | None = None
        self._order: list[int] = []
        self._source: PoseSource | None = None
        self._seen = False

    def copy(self) -> "Acquisition":
        """One that goes on by itself and leaves this one as it is."""
        other = copy.copy(self)
        other._detector = self._detector.copy()
        return other

    @property
    def source(self) -> PoseSource:
        """Where the stored poses come from; settled by the first row."""
        if self._source is not None:
            return self._source
        return PoseSource.MEASURED if self._seen else PoseSource.REFERENCE

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
        self._seen = self._seen or sample.position is not None
        if self._judged is None or sample.capture or not 0.0 <= sample.time - self._judged.time < THINNED:
            self.arm_state = self._judge(sample)
            self._judged = sample
        if not sample.capture or self.capture.done:
            return None
        return self.store(force=self._forced)

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
        sample, index, place = self.latest, self.capture.current, self.place()
        reason = "no sample has come from the source yet" if sample is None else self._refusal(sample, force)
        if not reason and not place.is_known and not anywhere:
            reason = f"the tool is {place.text}"
            if place.looks_like is not None:
                name = self.capture.targets[place.looks_like].name
                reason += f"; this looks like {name}: store it as {name}?"
        if reason or sample is None:
            return self._say(f"not stored: {reason}")
        self._source = self.source
        self.capture = self.capture.store(self._completed(sample))
        self._order = [*(i for i in self._order if i != index), index]
        doubts = [] if self.arm_state is ArmState.STILL else [f"the arm {self.arm_state}"]
        doubts += [f"the tool is {place.text}"] if place.text else []
        doubt = f" ({'; '.join(doubts)})" if doubts else ""
        end = "; that was the last one" if self.capture.done else ""
        return self._say(f"{self.capture.targets[index].name} stored{doubt}{end}", changed=True)

    def store_as(self, index: int) -> Event:
        """Make the target current at which the tool stands, and store the latest sample for it."""
        before, self.capture = self.capture, self.capture.go_to(index)
        event = self.store()
        if not event.changed:
            self.capture = before
        return event

    def place(self) -> TargetPlace:
        """Where the tool stands among the targets.

        The measured pose decides wherever it is at a target. Where it is at none, as with an instrument in a
        frame of its own, the nominal arm does; and where nothing is measured, what is clearly nearer to it,
        as its own errors may be large.
        """
        sample, current = self.latest, self.capture.current
        if sample is None or self.capture.target.pose is None:
            return TargetPlace()
        pose, _, turned, measured = self._where()
        expected = tool_poses(self._robot, Motion(sample.q[None]))[0]
        by_joints = self._distances(expected, turned=True)
        if not measured or pose is None:
            nearest, own = int(np.argmin(by_joints)), by_joints[current]
            is_other = by_joints[nearest] * CLEARER < own > 1.0
            is_known = not is_other and own <= ROUGH
            return self._place(own, expected, True, is_known, nearest if is_other else None)
        seen = self._distances(pose, turned=turned)
        by_pose = seen if seen.min() <= 1.0 else by_joints
        nearest = int(np.argmin(by_pose))
        is_other = by_pose[nearest] <= 1.0 < by_pose[current]
        return self._place(
            seen[current], pose, turned, bool(by_pose[current] <= 1.0), nearest if is_other else None
        )

    def _place(
        self, off: float, pose: Matrix4, turned: bool, is_known: bool, looks_like: int | None
    ) -> TargetPlace:
        if off <= 1.0:
            return TargetPlace(off=float(off))
        target = self.capture.target
        assert target.pose is not None
        error = se3.pose_error(pose, target.pose)
        angle = f" and {np.rad2deg(np.linalg.norm(error[3:])):.1f}°" if turned else ""
        text = f"{1e3 * np.linalg.norm(error[:3]):.1f} mm{angle} from {target.name}"
        return TargetPlace(float(off), looks_like, is_known, text)

    def _distances(self, pose: Matrix4, *, turned: bool) -> np.ndarray:
        """From a pose to every target, in multiples of what it may be off; infinite to one without pose."""
        nowhere = se3.pose(np.eye(3), np.full(3, np.inf))
        poses = np.stack([nowhere if t.pose is None else t.pose for t in self.capture.targets])
        error = se3.pose_error(np.broadcast_to(pose, poses.shape), poses)
        shares = (
            np.linalg.norm(error[:, :3], axis=1) / MAX_DISTANCE,
            np.linalg.norm(error[:, 3:], axis=1) / MAX_ANGLE,
        )
        return np.where(turned & np.array(self._oriented), np.maximum(*shares), shares[0])

    def _refusal(self, sample: Sample, force: bool) -> str | None:
        """Why the sample can't be stored now; None if it can."""
        capture = self.capture
        if self.silence > 0.0:
            return f"the source has been silent for {self.silence:.0f} s"
        if self._order and capture.done and capture.current == self._order[-1]:
            return "every target has its row; retake the last one to replace it"
        if self.source is PoseSource.MEASURED and sample.position is None:
            return "the instrument does not see the tool"
        if self.source is PoseSource.REFERENCE and capture.target.pose is None:
            return "neither the source nor the target gives a pose of the tool"
        if force:
            return None
        if self.arm_state is ArmState.MOVING:
            return f"the arm {self.arm_state}; wait, or force it"
        if self._order and not self._has_moved(sample):
            return "the arm has not moved since the last row; move it on, or force it"
        return None

    def _has_moved(self, sample: Sample) -> bool:
        last = self.capture.taken[self._order[-1]]
        return last is None or bool(np.abs(sample.q - last.q).max() > self._detector.joint)

    def _completed(self, sample: Sample) -> Sample:
        """The sample with the pose that is to be stored with it."""
        pose = self.capture.target.pose
        if self.source is PoseSource.MEASURED or pose is None:
            return sample
        turn = pose[:3, :3] if self._oriented[self.capture.current] else None
        return replace(sample, position=pose[:3, 3], rotation=turn)

    def again(self) -> Event:
        """Drop the row of the current target, or else the one that was stored last; its target is current."""
        if not self._order:
            return self._say("there is no row to retake")
        current = self.capture.current
        index = current if self.capture.taken[current] is not None else self._order[-1]
        self._order = [i for i in self._order if i != index]
        self.capture = self.capture.again(index)
        return self._say(f"{self.capture.target.name}: its row was discarded; measure it again", changed=True)

    def step(self, by: int) -> Event:
        """Make another target current, counted from the present one and around."""
        self.capture = self.capture.go_to((self.capture.current + by) % len(self.capture.targets))
        stored = self.capture.taken[self.capture.current] is not None
        return self._say(f"{self.capture.target.name}" + (" has a row, which the next replaces" * stored))

    def dataset(self, *, source: str) -> Dataset:
        """What is stored, in the order of the targets."""
        found = self.capture.dataset(source=source)
        return replace(found, notes=(*found.notes, f"stored with the joints: {self.source}"))

    def status(self) -> Status:
        """All that a view shows."""
        target = self.capture.target.pose
        pose, position, rotation, measured = self._where()
        off = None if target is None or pose is None else se3.pose_error(pose, target)
        return Status(
            name=self.capture.target.name,
            current=self.capture.current,
            stored=tuple(sample is not None for sample in self.capture.taken),
            target=target,
            pose=pose,
            position=off[:3] if off is not None and position else None,
            rotation=off[3:] if off is not None and rotation else None,
            place=self.place(),
            measured=measured,
            arm_state=self.arm_state,
            source=self.source,
            silence=self.silence,
            message=self.message,
        )

    def _where(self) -> tuple[Matrix4 | None, bool, bool, bool]:
        """Pose of the tool; whether its position and its orientation are known, and whether measured."""
        sample = self.latest
        if sample is None:
            return None, False, False, False
        if not self._seen:
            return tool_poses(self._robot, Motion(sample.q[None]))[0], True, True, False
        if sample.position is None:
            return None, False, False, True
        turn = np.eye(3) if sample.rotation is None else sample.rotation
        return se3.pose(turn, sample.position), True, sample.rotation is not None, True

    def _say(self, message: str, *, changed: bool = False) -> Event:
        self.message = message
        return Event(message, changed)

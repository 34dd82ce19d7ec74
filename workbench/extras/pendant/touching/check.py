"""The morning check: did a joint, the tool, the base or a seat move, or does the arm still warm up?

Seats are touched today, and were touched once when the arm was good (the reference). With p(q) the tip by the
calibrated arm, and touches of one seat in one posture as a group,

    p_i = c_group(i) − Σ_k h_ik x_k

where the columns h of each cause act on today's touches: ∂p/∂q_j for a moved zero of joint j, R_i for a moved
tool, a rigid motion for the base, time for warming up. The model's errors are the same in both visits of a
group and cancel in c. Each cause is judged by an F test against none; what is left under it gives the noise.
Seven tenths of the chance of a false alarm are shared by the joints, the rest by all other causes.

Without a reference a group is a seat: only what differs between postures is seen, and the model's own errors
count as noise.
"""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple, final

import numpy as np
from rich.console import RenderableType
from scipy import special

from workbench.arm.joint_units import shown_units, sliding
from workbench.arm.robot import Robot
from workbench.base.arguments import Length, Like, checked_arguments
from workbench.base.errors import DataError
from workbench.base.wording import in_mm, joint_list
from workbench.data.arguments import RobotLike
from workbench.data.dataset import Dataset
from workbench.extras.pendant.touching.causes import (
    FALSE_ALARM,
    SEEN,
    PossibleCause,
    TestedCause,
    causes_of,
    groups_of,
    tested,
)
from workbench.extras.pendant.touching.touches import EXACT_SCATTER, Touches, check_wanted, read_touches, tips
from workbench.report.json import Json, document
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown
from workbench.report.tables import headed, new_table

SCHEMA = "workbench.check/1"
POWER = 0.95
MIN_TOUCHES = 6
SCATTERED = 0.005
"""Scatter of touches of one seat, as a part of the reach, that no error of a calibrated arm explains."""
WANTED = 5e-5
"""Displacement of the tip that a check should find, by default [m]."""
MOVES = 0.01
"""Minimum displacement of the tip by a joint that is looked at [m/rad or m/m]."""
MIN_LIKELIHOOD_GAP = 6.0
"""Difference of twice the log likelihood, penalised, below which causes are alike."""
SETTLING, SHORTEST, LONGEST = 1200.0, 300.0, 7200.0
"""Time constant of warming up where the touches don't show it, and its bounds [s]."""


class Health(StrEnum):
    """What a check found."""

    GOOD = "good"
    MOVED = "moved"
    WARMING = "warming up"
    SLIPPED = "a touch slipped"
    UNCERTAIN = "cannot tell"


class ZeroShift(NamedTuple):
    """The zero of a joint, as if it alone had moved [rad or m].

    Args:
        std: Standard error.
        minimum: Smallest shift that these touches find in 95 of 100 cases.
        lever: Displacement of the tip by the joint, root mean square over the touches [m/rad or 1].
        seen: Whether these touches show it.
    """

    shift: float
    std: float
    minimum: float
    lever: float
    seen: bool


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Check(AbstractShown):
    """Result of a morning check.

    Args:
        calibrated: The arm as it was.
        found: What is beyond chance, the likeliest first.
        noise: Standard deviation of a touch along each axis [m].
        wait: Time until the arm is warm [s]; NaN where it does not warm up.
        touches: How many today, and in the reference.
        wanted: Displacement that should be found [m].
    """

    calibrated: Robot
    found: tuple[TestedCause, ...]
    joints: tuple[ZeroShift, ...]
    noise: float
    wait: float
    touches: tuple[int, int]
    wanted: float

    @property
    def best(self) -> TestedCause | None:
        """The likeliest cause, if any is beyond chance."""
        return self.found[0] if self.found else None

    @property
    def detectable(self) -> float:
        """Displacement of the tip by any joint that is seen, found in 95 of 100 cases [m]."""
        return max((j.minimum * j.lever for j in self.joints if j.seen), default=0.0)

    @property
    def _unseen(self) -> list[int]:
        return [k for k, joint in enumerate(self.joints) if not joint.seen]

    @property
    def health(self) -> Health:
        if self.best is not None:
            kinds = {"warming": Health.WARMING, "touch": Health.SLIPPED}
            return kinds.get(self.best.cause.kind, Health.MOVED)
        return Health.GOOD if 0.0 < self.detectable <= self.wanted else Health.UNCERTAIN

    @property
    def sentence(self) -> str:
        limit = f"a displacement of {in_mm(self.detectable)} by any joint"
        if self.best is None:
            if self.health is Health.GOOD:
                lost = f"; {joint_list(self._unseen)} can't be observed" if self._unseen else ""
                return f"good: {limit} would have been found (95 %, false alarms 1 %){lost}"
            if not any(joint.seen for joint in self.joints):
                return "the touches observe no joint; touch two or three seats, each in two postures or more"
            times = int(np.ceil(self.touches[0] * (self.detectable / self.wanted) ** 2))
            return (
                f"nothing was found, but these touches only detect {limit}, not {in_mm(self.wanted)}; touch "
                f"about {times} times{'' if self.touches[1] else ', or give --reference'}"
            )
        return f"{self._text(self.best)}{self._alike}"

    @property
    def _alike(self) -> str:
        assert self.best is not None
        rivals = [t.cause.text for t in self.found[1:] if t.score < self.best.score + MIN_LIKELIHOOD_GAP]
        return f"; or {' or '.join(rivals[:3])}, which these touches can't distinguish" if rivals else ""

    def _text(self, tested: TestedCause) -> str:
        cause = tested.cause
        if cause.kind == "joint":
            factor = 1e3 if sliding(self.calibrated)[cause.joint] else float(np.rad2deg(1.0))
            value, half = factor * tested.x[0], factor * 1.96 * tested.std[0]
            digits = int(np.clip(1 - np.floor(np.log10(max(half, 1e-9))), 1, 5))
            unit = shown_units(self.calibrated)[cause.joint]
            return f"{cause.text} moved by {signed(value, digits)}{unit} ± {half:.{digits}f}{unit}"
        if cause.kind == "warming":
            minutes = int(5 * np.ceil(self.wait / 300.0))
            return f"still warming up: wait {minutes} min and check again"
        if cause.kind == "touch":
            return f"{cause.text} does not fit the others by {in_mm(_length(tested))}: touch that seat again"
        return f"{cause.text} moved by {in_mm(_length(tested))}"

    @property
    def robot(self) -> Robot:
        """The arm with the zero that moved; as it was where no joint did."""
        if self.best is None or self.best.cause.kind != "joint":
            return self.calibrated
        name = self.calibrated.joint_offsets[self.best.cause.joint]
        value = float(self.calibrated.values((name,))[0] + self.best.x[0])
        return self.calibrated.with_values({name: value})

    def summary(self) -> RenderableType:
        table = new_table(
            "Joints, each as if it alone had moved", "joint", "by", "± (95 %)", "found from", "at the tip"
        )
        units, slides = shown_units(self.calibrated), sliding(self.calibrated)
        for k, joint in enumerate(self.joints):
            factor = 1e3 if slides[k] else float(np.rad2deg(1.0))
            shift, half, minimum = (factor * v for v in (joint.shift, 1.96 * joint.std, joint.minimum))
            cells = [f"{signed(shift, 4)}{units[k]}", f"{half:.4f}{units[k]}", f"{minimum:.4f}{units[k]}"]
            cells.append(in_mm(joint.minimum * joint.lever))
            table.add_row(str(k + 1), *(cells if joint.seen else ["can't be observed", "", "", ""]))
        noise = f"a touch repeats to {in_mm(self.noise)} along each axis (standard deviation)"
        return headed(f"{self.calibrated.name}: {self.sentence}", table, notes=[noise])

    def json(self) -> Json:
        return document(
            SCHEMA,
            robot=self.calibrated.name,
            verdict=self.health,
            message=self.sentence,
            joints=[
                {"joint": k, "shift": j.shift, "std": j.std, "found_from": j.minimum}
                | {"found_from_at_tip": j.minimum * j.lever, "seen": j.seen}
                for k, j in enumerate(self.joints, start=1)
            ],
            found=[
                {"cause": t.cause.text, "kind": t.cause.kind}
                | {"values": t.x, "std": t.std, "chance": t.chance}
                for t in self.found
            ],
            power={"displacement": self.detectable, "probability": POWER, "false_alarms": FALSE_ALARM},
            noise=self.noise,
            wait_s=self.wait,
            touches={"today": self.touches[0], "reference": self.touches[1]},
        )


@checked_arguments()
def check(
    robot: RobotLike,
    touches: Path | Like[Dataset],
    *,
    reference: Path | Like[Dataset] | None = None,
    wanted: Like[Length] = WANTED,
) -> Check:
    """Check an arm by touching two or three seats, joints alone.

    Args:
        robot: The calibrated arm with its tool.
        touches: Today's joint positions at the seats, named in `contact`; with `time[s]` warming up is seen.
        reference: The same from a day on which the arm was good, in the same postures.
        wanted: Displacement of the tip that should be found in 95 of 100 cases [m].

    Raises:
        DataError: fewer than six touches, or seats that the reference lacks.
        OptionError: a displacement that is not positive.
    """
    check_wanted(wanted, "the displacement to find")
    today = read_touches(touches, robot)
    before = None if reference is None else read_touches(reference, robot)
    if len(today) < MIN_TOUCHES:
        raise DataError(
            f"{today.source}: touch two or three seats {MIN_TOUCHES} times or more together, got {len(today)}"
        )
    q = today.q if before is None else np.concatenate([today.q, before.q])
    groups = groups_of(today, before)
    is_today = np.arange(len(q)) < len(today)
    is_timed = np.isfinite(today.time).all() and np.ptp(today.time) > 0.0
    time = today.time - today.time[0] if is_timed else None
    causes = list(causes_of(robot, today, q, is_today, before is not None, time))
    of_group = np.eye(max(groups) + 1)[groups]
    clear = np.kron(np.eye(len(q)) - of_group @ np.linalg.pinv(of_group), np.eye(3))  # what places leave
    spare = 3 * (len(q) - len(set(groups)))
    y = clear @ tips(robot, q).ravel()
    judged = [t for c in causes if (t := tested(c, clear, y, spare)) is not None]
    found = sorted((t for t in judged if t.is_found), key=lambda t: t.score)
    noise = found[0].noise if found else max(float(np.sqrt(y @ y / spare)), EXACT_SCATTER)
    if (scatter := noise if before is None else _scatter(robot, before)) > SCATTERED * robot.reach:
        raise DataError(
            f"{(before or today).source}: touches of one seat disagree by {in_mm(scatter)}: choose "
            "the robot that touched, and name the seats in a column 'contact'"
        )
    warming = next((t for t in found if t.cause.kind == "warming"), None)
    return Check(
        calibrated=robot,
        found=tuple(found),
        joints=tuple(_shift(c, judged, clear, noise, spare, len(today)) for c in causes if c.kind == "joint"),
        noise=noise,
        wait=np.nan if warming is None or time is None else _wait(warming, float(time.max()), wanted),
        touches=(len(today), 0 if before is None else len(before)),
        wanted=wanted,
    )


def _scatter(robot: Robot, touches: Touches) -> float:
    """Root mean square distance of the tips from the middle of their seat, in whatever posture [m]."""
    same = np.equal.outer(touches.names, touches.names)
    at = tips(robot, touches.q)
    return float(np.sqrt(((at - same / same.sum(1) @ at) ** 2).sum(1).mean()))


def _shift(
    cause: PossibleCause, tests: list[TestedCause], clear: np.ndarray, noise: float, spare: int, count: int
) -> ZeroShift:
    """A joint's shift, and what would have been found of one."""
    own = next((t for t in tests if t.cause is cause), None)
    whole, left = (float(np.linalg.norm(part)) for part in (cause.columns, clear @ cause.columns))
    lever = whole / np.sqrt(count)
    if own is None or left <= SEEN * whole or lever <= MOVES:
        return ZeroShift(np.nan, np.nan, np.nan, lever, False)
    limit = special.stdtrit(spare - 1, 1.0 - 0.5 * cause.alarm) + special.stdtrit(spare - 1, POWER)
    return ZeroShift(float(own.x[0]), float(own.std[0]), float(limit * noise / left), lever, True)


def _length(tested: TestedCause) -> float:
    return float(np.linalg.norm(tested.x[:3]))


def _wait(tested: TestedCause, span: float, wanted: float) -> float:
    """Time until what is left of the warming is less than required, from how far and how fast [s]."""
    drift, offset = tested.x[:3], tested.x[3:]
    if not len(offset):
        return SETTLING
    left, speed = float(np.linalg.norm(drift + offset)), float(np.linalg.norm(drift)) / span
    settling = np.clip(left / max(speed, 1e-12), SHORTEST, LONGEST)
    return float(np.clip(settling * np.log(max(left / wanted, 1.0)), SHORTEST, LONGEST))

"""What may have happened to an arm between two visits of its seats, and the F test of each cause."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import special

from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.extras.pendant.touching.touches import EXACT_SCATTER, Touches, flanges, tips

FALSE_ALARM = 0.01
"""Chance of an alarm though nothing moved."""
JOINTS_SHARE = 0.7
"""Part of it that the joints share."""
SAME_POSTURE = float(np.deg2rad(10.0))
"""Joints that differ by less are one posture [rad or m]."""
SEEN = 0.05
"""Part of a joint's effect that other unknowns must leave for it to be seen."""


class PossibleCause(NamedTuple):
    """Something that may have happened.

    Args:
        text: For people, such as `joint 3`.
        kind: joint, tool, base, seat, warming or touch.
        columns: What it does to the tips for each of its unknowns, where other unknowns are free (3 rows, k).
        alarm: Chance of a false alarm that it may take.
        joint: Counted from 0; -1 for others.
    """

    text: str
    kind: str
    columns: Float[np.ndarray, "numbers k"]
    alarm: float
    joint: int = -1


class TestedCause(NamedTuple):
    """A cause against none.

    Args:
        x: Its unknowns [rad or m].
        std: Their standard errors.
        chance: Probability that chance alone explains as much.
        score: Twice the negative log likelihood, penalised by its unknowns; the smallest is the best.
        noise: Standard deviation of a touch along each axis under it [m].
    """

    cause: PossibleCause
    x: Float[np.ndarray, " k"]
    std: Float[np.ndarray, " k"]
    chance: float
    score: float
    noise: float

    @property
    def is_found(self) -> bool:
        return self.chance < self.cause.alarm


def groups_of(today: Touches, before: Touches | None) -> list[int]:
    """Group of every touch: its seat, and with a reference its posture there too."""
    if before is None:
        return np.unique(today.names, return_inverse=True)[1].tolist()
    centres: list[tuple[str, np.ndarray]] = []
    found = []
    for touches in (before, today):
        for k, (q, name) in enumerate(zip(touches.q, touches.names, strict=True)):
            far = [np.abs(q - at).max() if seat == name else np.inf for seat, at in centres]
            if min(far, default=np.inf) >= SAME_POSTURE:
                if touches is today:
                    raise DataError(
                        f"{today.source}: touch {today.rows[k] + 1} of '{name}' has no matching posture in "
                        "the reference; touch the same seats in the same postures, within 10° at each joint"
                    )
                far.append(0.0)
                centres.append((name, q))
            found.append(int(np.argmin(far)))
    return found[len(before) :] + found[: len(before)]


def causes_of(
    robot: Robot,
    today: Touches,
    q: np.ndarray,
    is_today: np.ndarray,
    has_reference: bool,
    time: np.ndarray | None,
) -> Iterator[PossibleCause]:
    """Everything that may have happened, with its share of the chance of a false alarm."""
    mine = is_today[:, None, None]
    jacobian = geometric_jacobian(robot.with_frames(base=Frame()), q)[:, :3]
    for joint in range(robot.dof):
        columns = (-jacobian[:, :, [joint]] * mine).reshape(-1, 1)
        yield PossibleCause(
            f"joint {joint + 1}", "joint", columns, JOINTS_SHARE * FALSE_ALARM / robot.dof, joint
        )
    at, each = tips(robot, q), np.tile(np.eye(3), (len(q), 1, 1))
    others = [("the tool", "tool", -flanges(robot, q)[:, :3, :3])]
    if has_reference:
        others.append(
            ("the base or the plate with the seats", "base", np.concatenate([each, -se3.skew(at)], axis=2))
        )
        names = np.array([*today.names, *[""] * int((~is_today).sum())])
        if len(set(today.names)) > 1:
            others += [
                (f"seat {n}", "seat", each * (names == n)[:, None, None]) for n in dict.fromkeys(today.names)
            ]
    if time is not None:
        late = np.concatenate([time, np.zeros(len(q) - len(time))])[:, None, None]
        drift = each * late / max(float(time.max()), 1e-9)
        others.append(
            ("warming up", "warming", np.concatenate([drift, each], axis=2) if has_reference else drift)
        )
    for k in range(len(today)):
        others.append((f"touch {today.rows[k] + 1}", "touch", each * (np.arange(len(q)) == k)[:, None, None]))
    for text, kind, columns in others:
        flat = (columns * mine).reshape(3 * len(q), -1)
        yield PossibleCause(text, kind, flat, (1.0 - JOINTS_SHARE) * FALSE_ALARM / len(others))


def tested(cause: PossibleCause, clear: np.ndarray, y: np.ndarray, spare: int) -> TestedCause | None:
    """A cause against none; None where these touches can't show it."""
    columns = clear @ cause.columns
    scale = np.linalg.norm(cause.columns, axis=0)
    u, s, vt = np.linalg.svd(columns / np.where(scale > 0.0, scale, 1.0), full_matrices=False)
    kept = s > SEEN * max(float(s.max(initial=0.0)), SEEN)
    rank = int(kept.sum())
    if rank == 0 or spare - rank < 2:
        return None
    part = u[:, kept].T @ y
    whole = float(y @ y)
    left = max(whole - float(part @ part), (spare - rank) * EXACT_SCATTER**2)
    ratio = (float(part @ part) / rank) / (left / (spare - rank))
    chance = float(special.fdtrc(rank, spare - rank, ratio))
    root = vt[kept].T / s[kept] / np.where(scale > 0.0, scale, 1.0)[:, None]
    std = np.sqrt((root**2).sum(1) * left / (spare - rank))
    score = spare * np.log(left) + rank * np.log(spare)
    return TestedCause(cause, root @ part, std, chance, float(score), float(np.sqrt(left / (spare - rank))))

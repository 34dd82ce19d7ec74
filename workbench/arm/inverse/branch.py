"""The solutions of the inverse kinematics at one target, and the choice of one of them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.damped_newton import Reached, Task
from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.base.wording import in_mm

TURN = 2.0 * np.pi
LIMIT_MARGIN = float(np.deg2rad(10.0))
"""Margin of a planned target from every limit, so that an arm with errors also reaches it [rad or m]; a
quarter of the travel for a joint with a small range."""
LIMIT_SLACK = 1e-9
"""Tolerance on the limits [rad or m]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Branch:
    """One solution.

    Args:
        q: Joint coordinates; the turn within the limits nearest to their middle [rad or m].
        name: Unique within a result.
        within_limits: Whether some turn of every joint is within its limits.
        margin: Distance to the nearest limit, negative outside [rad or m].
        manipulability: Smallest singular value of the task's Jacobian, lengths in units of the arm's.
        limits: The limits used.
        slides: Which joints have no other turns: they slide, or drive others by a fraction.
    """

    q: Float[np.ndarray, " n"]
    name: str
    within_limits: bool
    margin: float
    manipulability: float
    limits: Float[np.ndarray, "n 2"]
    slides: Bool[np.ndarray, " n"]

    @cached_property
    def room(self) -> float:
        """Smallest excess of a joint's margin over that of planned targets."""
        return float((margins(self.q[None], self.limits) - planned_margins(self.limits)).min())

    @property
    def is_roomy(self) -> bool:
        return self.room >= -LIMIT_SLACK

    def nearest_turn(self, q: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The q of this branch nearest to another q, within the limits if the branch is."""
        turns = np.where(self.slides, 0.0, np.round((q - self.q) / TURN))
        if self.within_limits:
            with np.errstate(invalid="ignore"):
                minimum = np.ceil((self.limits[:, 0] - self.q - 1e-12) / TURN)
                maximum = np.floor((self.limits[:, 1] - self.q + 1e-12) / TURN)
            turns = np.where(self.slides, 0.0, np.clip(turns, minimum, maximum))
        return frozen(self.q + TURN * turns)


def representative(
    q: Float[np.ndarray, "rows n"], limits: Float[np.ndarray, "n 2"], slides: Bool[np.ndarray, " n"]
) -> Float[np.ndarray, "rows n"]:
    """The turn of every joint nearest to the middle of its limits."""
    low, high = limits.T
    bounded = np.isfinite(low) & np.isfinite(high)
    middle = np.where(bounded, 0.5 * (np.where(bounded, low, 0.0) + np.where(bounded, high, 0.0)), 0.0)
    middle = np.clip(middle, low, high)
    turned = q - TURN * np.round((q - middle) / TURN)
    return np.where(slides, q, turned)


def margins(q: Float[np.ndarray, "rows n"], limits: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "rows n"]:
    """Distance of every joint to its nearest limit, negative outside."""
    return np.minimum(q - limits[:, 0], limits[:, 1] - q)


def planned_margins(limits: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
    """Required margin of every joint at a planned target (`LIMIT_MARGIN`)."""
    return np.minimum(LIMIT_MARGIN, 0.25 * (limits[:, 1] - limits[:, 0]))


@dataclass(frozen=True, eq=False)
class InverseResult:
    """All solutions at one target.

    Args:
        branches: Those within the limits first, best manipulability first among them; of infinitely many (a
            redundant arm or task, a singular pose) representatives.
        task: Which part of the pose was required.
        find_nearest: Computes `nearest` on first use, which takes longer than the branches.
    """

    branches: tuple[Branch, ...]
    task: Task
    find_nearest: Callable[[], Reached]

    @cached_property
    def nearest(self) -> Reached:
        """The best branch within the limits, or the geometry's nearest posture within them."""
        return self.find_nearest()

    @property
    def reason(self) -> str | None:
        """Why no branch is within the limits; None if one is."""
        if self.reachable:
            return None
        if not self.branches:
            distance, angle = float(self.nearest.position_error), np.degrees(self.nearest.rotation_error)
            return f"out of reach: the nearest posture is {in_mm(distance)} and {angle:.2g}° off"
        best = max(self.branches, key=lambda branch: branch.margin)
        (low, high), needs = best.limits.T, best.q
        beyond = np.flatnonzero((needs < low) | (needs > high)).tolist()
        parts = (f"joint {k + 1} (needs {needs[k]:.4g}, has {low[k]:.4g} to {high[k]:.4g})" for k in beyond)
        return f"reachable only outside the limits of {' and '.join(parts)}"

    @property
    def reachable(self) -> bool:
        """Whether a branch is within the limits."""
        return any(b.within_limits for b in self.branches)

    @property
    def within_limits(self) -> tuple[Branch, ...]:
        return tuple(b for b in self.branches if b.within_limits)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(b.name for b in self.branches)


def nearest_branch(result: InverseResult, q: Float[np.ndarray, " n"]) -> Branch | None:
    """The branch nearest to q up to full turns, within the limits if any is; None without branches."""
    return nearest_of(result.within_limits or result.branches, q)


def nearest_of(branches: tuple[Branch, ...], q: Float[np.ndarray, " n"]) -> Branch | None:
    """The branch nearest to q up to full turns; None without branches."""

    def distance(branch: Branch) -> float:
        gap = branch.q - q
        return float(np.linalg.norm(np.where(branch.slides, gap, gap - TURN * np.round(gap / TURN))))

    return min(branches, key=distance, default=None)


def choose(
    result: InverseResult,
    *,
    near: Float[np.ndarray, " n"] | None = None,
    branch: str | Float[np.ndarray, " n"] = "auto",
) -> Branch | None:
    """One branch by name, by joint coordinates, or the best.

    Args:
        result: Of `solve`.
        near: Preferred joint coordinates; the turn nearest to them is taken.
        branch: A name; joint coordinates (their nearest branch); or `auto`: the nearest to `near`, or without
            it the one farthest from singularity and limits.

    Returns:
        The branch, its q at the right turn; None if `auto` or coordinates find none within the limits. A
        named branch is returned even if it lies outside the limits: see its `within_limits`.
    """
    if isinstance(branch, np.ndarray):
        chosen = nearest_branch(result, branch) if result.reachable else None
        near = branch if near is None else near
    elif branch != "auto":
        chosen = next((b for b in result.branches if b.name == branch), None)
        if chosen is None:
            known = ", ".join(f"'{n}'" for n in result.names) or "none at all"
            raise OptionError(f"this target has no branch '{branch}'; it has {known}")
    elif not result.reachable:
        chosen = None
    elif near is not None:
        chosen = nearest_branch(result, near)
    else:
        chosen = max(result.within_limits, key=quality)
    if chosen is None or near is None:
        return chosen
    turned = chosen.nearest_turn(near)
    return replace(chosen, q=turned, margin=float(margins(turned[None], chosen.limits).min()))


def quality(branch: Branch) -> float:
    """Measure that grows with the distance from limits, up to half a radian, and from singularities."""
    return min(max(branch.margin, 0.0), 0.5) * branch.manipulability


def roomy(branches: tuple[Branch, ...]) -> tuple[Branch, ...]:
    """Branches that keep `LIMIT_MARGIN` from the limits, or, if none does, those with the largest margin."""
    minimum = min(0.0, max((b.room for b in branches), default=0.0)) - LIMIT_SLACK
    return tuple(b for b in branches if b.room >= minimum)

"""The ways to reach one target, and the choice of one of them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.branch import TURN, Branch, margins
from workbench.arm.inverse.damped_newton import Task
from workbench.base.errors import OptionError


@dataclass(frozen=True, eq=False)
class Nearest:
    """The closest that the arm comes to a target within its limits.

    Args:
        q: Joint coordinates [rad or m].
        position_error: Distance of the tool from the target [m].
        rotation_error: Angle between the two, as far as the task asks [rad].
    """

    q: Float[np.ndarray, " n"]
    position_error: float
    rotation_error: float


@dataclass(frozen=True, eq=False)
class InverseResult:
    """All ways to reach one target.

    Args:
        branches: Those within the limits first, best manipulability first among them.
        finite: False where the solutions are endlessly many (a redundant arm or task, a singular pose) and
            `branches` are representatives.
        note: What else the user should know, such as that the arm is redundant.
        task: What of the pose was asked for.
        explain: Finds `reason` and `nearest` when one of them is first asked for: where nothing is within the
            limits, that takes longer than the branches.
    """

    branches: tuple[Branch, ...]
    finite: bool
    note: str | None
    task: Task
    explain: Callable[[], tuple[str | None, Nearest]]

    @cached_property
    def _explained(self) -> tuple[str | None, Nearest]:
        return self.explain()

    @property
    def reason(self) -> str | None:
        """Why no branch is within the limits; None if one is."""
        return None if self.reachable else self._explained[0]

    @property
    def nearest(self) -> Nearest:
        """The best branch within the limits, or the nearest configuration within them."""
        return self._explained[1]

    @property
    def reachable(self) -> bool:
        """Whether a branch is within the limits."""
        return any(b.within_limits for b in self.branches)

    @property
    def within_limits(self) -> tuple[Branch, ...]:
        """The branches that are within the limits."""
        return tuple(b for b in self.branches if b.within_limits)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all branches."""
        return tuple(b.name for b in self.branches)


def nearest_branch(result: InverseResult, q: Float[np.ndarray, " n"]) -> Branch | None:
    """The branch nearest to q up to full turns, within the limits if any is; None without branches."""
    return nearest_of(result.within_limits or result.branches, q)


def nearest_of(branches: tuple[Branch, ...], q: Float[np.ndarray, " n"]) -> Branch | None:
    """The one nearest to q up to full turns; None without branches."""
    return min(branches, key=lambda b: float(np.linalg.norm(_gap(b, q))), default=None)


def choose(
    result: InverseResult,
    *,
    near: Float[np.ndarray, " n"] | None = None,
    branch: str | Float[np.ndarray, " n"] = "auto",
) -> Branch | None:
    """One branch by name, by joint coordinates, or the best.

    Args:
        result: Of `solve`.
        near: Joint coordinates to stay near to; the turn of the choice is then the nearest to them.
        branch: A name; joint coordinates (the nearest branch is meant); or `auto`: the nearest to `near`, or
            without it the one farthest from singularity and limits.

    Returns:
        The branch, its q at the right turn; None where `auto` or coordinates find none within the limits. A
        named branch is returned even if it lies outside the limits: see its `within_limits`.

    Raises:
        OptionError: the result has no branch of that name.
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
    return chosen if chosen is None or near is None else _at_turn(chosen, near)


def _gap(branch: Branch, q: np.ndarray) -> np.ndarray:
    gap = branch.q - q
    return np.where(branch.slides, gap, gap - TURN * np.round(gap / TURN))


def quality(branch: Branch) -> float:
    """Grows with the distance from limits, up to half a radian, and from singularities."""
    return min(max(branch.margin, 0.0), 0.5) * branch.manipulability


def _at_turn(branch: Branch, q: np.ndarray) -> Branch:
    turned = branch.nearest_turn(q)
    return replace(branch, q=turned, margin=float(margins(turned[None], branch.limits).min()))

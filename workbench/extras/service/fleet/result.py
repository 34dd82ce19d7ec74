"""Arms compared over time."""

from dataclasses import dataclass
from datetime import date
from functools import cached_property
from typing import final

from workbench.base.wording import plural
from workbench.extras.service.fleet.history import History, Unread
from workbench.extras.service.fleet.movement import Movement
from workbench.report.result_display import AbstractPlotted


@dataclass(frozen=True, eq=False, kw_only=True)
class ArmReport:
    """One arm of a fleet.

    Args:
        moved: Constants that moved, those by the most σ first.
        tool: Displacement of the tool by all of them together [m].
        again: When the drift will have moved the tool by what is allowed; None without one in sight.
    """

    history: History
    moved: tuple[Movement, ...]
    tool: float
    again: date | None

    @property
    def worst(self) -> Movement | None:
        return max(self.moved, key=lambda m: m.tool, default=None)

    @property
    def joint(self) -> int | None:
        """The joint that wears: that of the worst movement, counted from 1."""
        return None if self.worst is None else self.worst.joint


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Fleet(AbstractPlotted):
    """Arms compared over time.

    Args:
        arms: By name.
        unread: Arms that could not be compared, and why.
        factor: How many times farther calibrations scatter than their standard errors imply.
        minimum: Number of σ from which a constant moved.
        allowed: Displacement of the tool by a drift after which to measure again [m].
    """

    arms: tuple[ArmReport, ...]
    unread: tuple[Unread, ...]
    factor: float
    minimum: float
    allowed: float

    @cached_property
    def worst_first(self) -> tuple[ArmReport, ...]:
        """The arms whose tool moved most come first; those in which nothing moved are last, by name."""
        return tuple(sorted(self.arms, key=lambda arm: -arm.tool))

    @property
    def worn(self) -> tuple[ArmReport, ...]:
        """Arms in which something moved, the worst first."""
        return tuple(arm for arm in self.worst_first if arm.moved)

    @property
    def verdict(self) -> str:
        many = plural(len(self.arms), "arm")
        if not self.worn:
            return f"Nothing moved in {many} by more than chance ({self.minimum:.1f} σ)."
        worst = self.worn[0]
        joint = "" if worst.joint is None else f", joint {worst.joint}"
        return (
            f"Something moved in {len(self.worn)} of {many}; most in {worst.history.arm}{joint}: the tool by "
            f"{1e3 * worst.tool:.2f} mm."
        )

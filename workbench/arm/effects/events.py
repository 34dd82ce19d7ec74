"""Events during the measurements, such as a knock at the tripod or a joint that warms up.

    Δv = −c w(t),      w = 1 before a step and 0 from it on; e^(−(t − t₀)/τ) of a warm-up

for elements of the base (the measuring frame), of the tool, or of a joint's drive; t is the time, or the row
in the file without times, and c [rad, m] the final change of the value. Constants are those after the event:
a saved arm needs no events, and poses outside any file have none. A base or tool declared as known may be so
only before the event: w = 0 before its step, and −1 from it on.
"""

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Insertion, Wrenches
from workbench.arm.effects.effect import AbstractEffect, Candidate, Law
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.motion import Motion
from workbench.report.numbers import readable, with_error

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

WARM_AT = 3.0
"""Number of time constants after which an arm counts as warm."""
NEVER_ROW = 2**62
"""Row number of an event that never happened: all rows lie before it."""
MIN_MIXED_SHARE = 0.5
"""Share of the rows on the shorter side of a step whose nearest posture is on the other side, relative to
random order, below which step and posture are confounded, unless one on the other side is as near as
others."""
ROWS_BEFORE_EVENT = 30
"""Rows before an event of a virtual arm."""


@dataclass(frozen=True)
class AbstractEvent(AbstractEffect):
    """An event.

    Args:
        row: First row of the file after it.
        time_s: Time of that row [s].
        is_timed: Whether times, rather than the order in the file, decide which rows lie before it.
    """

    row: int = 0
    time_s: float = 0.0
    is_timed: bool = False
    is_event = True
    moves_arm = False
    is_step: ClassVar[bool] = False
    credible = (0.05, 0.05)
    """A tripod or a tool that moved farther than 50 mm or 50 mrad was set up anew."""

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        """None: a search over the rows finds the times to try."""
        return iter(())

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "AbstractEvent":
        """After the first `ROWS_BEFORE_EVENT` rows, along and about random directions."""
        one = cls(() if cls.whole_arm else (joint,), row=ROWS_BEFORE_EVENT)
        size = rng.normal(size=len(one.names))
        return replace(one, coefficients=tuple((size / np.abs(size).max()).tolist()))

    def clock(self, motion: Motion) -> Float[np.ndarray, " rows"]:
        """Its clock [s, or rows]; later than everything if unknown."""
        known = motion.time if self.is_timed and motion.row is not None else motion.row
        return np.full(len(motion), np.inf) if known is None else np.asarray(known, float)

    @property
    def moment(self) -> float:
        """When it happened, by that clock."""
        return self.time_s if self.is_timed else float(self.row)

    def is_over(self, motion: Motion) -> Bool[np.ndarray, " rows"]:
        """Rows from it on; all of them if their times are unknown."""
        return self.clock(motion) >= self.moment

    @abstractmethod
    def weight(self, clock: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """Share of the change that was still to come at these clock readings."""

    @property
    @abstractmethod
    def when(self) -> str:
        """At which row it happened, or how fast."""

    @property
    @abstractmethod
    def remedy(self) -> str:
        """What to do about it."""

    def twin(self, dof: int) -> str:
        """What is the same motion in any rows, as a clause, where it concerns the first joint or the last."""
        if self.joints == (0,):
            return "a base or measuring frame that turned about its axis would give the same rows: check both"
        if self.joints == (dof - 1,):
            return "a tool that turned on its flange would give the same rows: check both"
        return ""

    @property
    def mark(self) -> str:
        """Label with its place for figures: `tool-step at row 60`."""
        return f"{self.label} {'at' if self.is_step else 'until'} row {self.row}"

    @property
    @abstractmethod
    def what(self) -> str:
        """Subject and verb of its sentence."""

    @property
    def plain(self) -> str:
        return f"{self.what[:1].lower()}{self.what[1:]} {'at' if self.is_step else 'until'} row {self.row}"

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        weight = self.weight(self.clock(motion))
        return -weight[:, None, None] * np.eye(len(self.elements(chain)))

    def stated(self, chain: Chain, motion: Motion, covariance: Float[np.ndarray, "c c"]) -> str:
        """Its sentence with the standard errors of its coefficients."""
        size = " and ".join(self._sizes(chain, np.sqrt(np.diagonal(covariance))))
        return f"{self.what} by {size} {self.when}; {self.remedy}"

    def _sizes(self, chain: Chain, std: np.ndarray) -> list[str]:
        """Lengths of its translation and of its rotation, with standard errors."""
        values, units = np.array(self.coefficients), np.array(self.units(chain))
        out = []
        for unit in ("m", "rad"):
            mine = units == unit
            size = float(np.linalg.norm(values[mine]))
            if mine.any() and size > 0.0:
                error = float(np.sqrt(((values[mine] / size * std[mine]) ** 2).sum()))
                if not size < error:
                    out.append(f"{with_error(1e3 * size, 1e3 * error)} {'mm' if unit == 'm' else 'mrad'}")
        return out or [readable(float(np.abs(values).max()), str(units[0]))]


@dataclass(frozen=True)
class AbstractStep(AbstractEvent):
    """An event between two rows.

    Args:
        known_before: Whether constants are those before it, as the moved part was known until then.
    """

    known_before: bool = False
    is_step = True

    def weight(self, clock: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        return (clock < self.moment) - float(self.known_before)

    @property
    def when(self) -> str:
        return f"at row {self.row}" + (f" ({self.time_s / 60.0:.3g} min)" if self.is_timed else "")

    def doubt(self, motion: Motion) -> str | None:
        """Whether the postures changed for good as well, which may be what differs."""
        after = self.is_over(motion)
        fewer = after if 2 * after.sum() <= len(after) else ~after
        if not fewer.any():
            return None
        place = motion.q / np.maximum(np.ptp(motion.q, axis=0), 1e-9)
        distance, nearest = (found[:, 1] for found in cKDTree(place).query(place, k=2))
        mixed = (fewer[nearest] != fewer)[fewer].mean() * len(fewer) / (~fewer).sum()
        across = cKDTree(place[fewer]).query(place[~fewer])[0].min()
        if mixed >= MIN_MIXED_SHARE or across <= np.median(distance):
            return None
        return "no pose before it resembles one after it, so it may be an effect of posture"

    @property
    def remedy(self) -> str:
        if self.joints:  # no session has a joint of its own
            return "re-measure the rows before it, or exclude them"
        return "re-measure the rows from it on, or fit them as a second session"


@final
@dataclass(frozen=True)
class FrameStep(AbstractStep):
    """The measuring frame moved once relative to the arm's base: six coefficients."""

    name = "frame-step"
    insertion = Insertion.DRIFT
    whole_arm = True
    what = "The instrument or the base was knocked, the measuring frame stepped"

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"frame_step{self.row}.{part}" for part in FRAME_PARTS)


@final
@dataclass(frozen=True)
class ToolStep(AbstractStep):
    """The tool, or the reflector on it, slipped once.

    Args:
        turns: Whether its orientation is observable too: six coefficients instead of three.
    """

    turns: bool = False
    name = "tool-step"
    insertion = Insertion.SLIP
    whole_arm = True
    what = "The tool or the reflector slipped"

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"tool_step{self.row}.{part}" for part in FRAME_PARTS[: 6 if self.turns else 3])


@final
@dataclass(frozen=True)
class ZeroStep(AbstractStep):
    """The zero of a joint stepped: one coefficient."""

    name = "zero-step"

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"joint{j + 1}.zero_step{self.row}" for j in self.joints)

    @property
    def what(self) -> str:
        return f"The zero of {self.where.lower()} stepped"


@final
@dataclass(frozen=True)
class WarmUp(AbstractEvent):
    """A joint's zero, or the measuring frame if no joint is named, drifts until warm.

    Args:
        row: The first warm row, after three time constants.
        begin: When warm-up started, by its clock [s, or rows].
        pace: Time constant τ [s, or rows].
    """

    begin: float = 0.0
    pace: float = 600.0
    name = "warm-up"
    insertion = Insertion.DRIFT

    @cached_property
    def names(self) -> tuple[str, ...]:
        tail = f"{self.pace:.4g}".replace(".", "_").replace("+", "")
        if not self.joints:
            return tuple(f"warm_up{tail}.{part}" for part in FRAME_PARTS)
        return tuple(f"joint{j + 1}.warm_up{tail}" for j in self.joints)

    def weight(self, clock: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        return np.exp(-np.maximum(clock - self.begin, 0.0) / self.pace)

    @property
    def when(self) -> str:
        if self.is_timed:
            return f"with a time constant of {self.pace / 60.0:.2g} min"
        return f"with a time constant of {self.pace:.2g} rows"

    @property
    def remedy(self) -> str:
        return f"measure after warm-up, or exclude the rows before row {self.row}"

    @property
    def what(self) -> str:
        return (
            f"{self.where} warmed up, its zero moved"
            if self.joints
            else "The measuring frame moved as it warmed up,"
        )

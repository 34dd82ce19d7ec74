"""Claims of a diagnosis: physical causes, and the map of what is left without a name."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.events import AbstractEvent
from workbench.base.advice import beside
from workbench.base.wording import joint_list
from workbench.diagnosis.claims.standard_errors import without_joints
from workbench.diagnosis.confidence import PROBABLE, Confidence
from workbench.diagnosis.drivers.driver import Driver
from workbench.identification.errors.row_errors import Errors

MIN_NOISE_SHARE = 1.0 / 3.0
"""Minimum share of the noise that a cause must explain."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cause:
    """A physical cause of what the geometry leaves.

    Args:
        effects: Its effects in the saved model.
        odds: Against the best other claim.
        contribution_mm: What it explains at the tool (`contributions.py`) [mm]; NaN where no positions were
            measured.
        text: Description for people.
        look_alikes: Claims that these rows can't distinguish from it, best first.
        unsure: Joints of its effects that are not named, counted from 0.
        doubt: Why it can't be certain, as a clause; empty if it can.
        contribution_deg: What it explains of orientations [deg]; NaN where none were measured.
        is_added: Whether its effects were added to the geometry; the direction of gravity is part of that.
        driver: What its law depends on.
        is_law: Whether that law is more than any smooth dependence on a driver.
    """

    effects: tuple[AbstractEffect, ...]
    odds: float
    contribution_mm: float
    text: str
    look_alikes: tuple[AbstractEffect, ...]
    unsure: tuple[int, ...] = ()
    doubt: str = ""
    contribution_deg: float = float("nan")
    is_added: bool = True
    driver: Driver = Driver.LOAD
    is_law: bool = True

    @property
    def claim(self) -> str:
        """Its description, or those of its look-alikes."""
        others = " or ".join(e.phrase for e in self.look_alikes)
        return f"{self.text}; or {others}" if others else self.text

    @property
    def stated(self) -> str:
        """Its claim with its confidence."""
        if self.look_alikes:
            return f"{self.claim} ({self.confidence})"
        first, *rest = self.text.split("; ", 1)
        return "; ".join([f"{first} ({self.confidence})", *rest])

    @property
    def sentence(self) -> str:
        """Its claim, and why it isn't certain."""
        return f"{self.claim}; {self.doubt}" if self.doubt else self.claim

    def doubted(self, doubt: str) -> "Cause":
        """The same, at most probable for this reason, if there is one."""
        return replace(self, odds=min(self.odds, PROBABLE), doubt=self.doubt or doubt) if doubt else self

    @property
    def kind(self) -> str:
        """Name of its effect."""
        return str(self.whole.name)

    @property
    def joints(self) -> tuple[int, ...]:
        """Counted from 0; empty where it concerns the whole arm."""
        return self.whole.joints

    @property
    def event(self) -> AbstractEvent | None:
        """The event, if the cause is one."""
        return self.whole if isinstance(self.whole, AbstractEvent) else None

    @property
    def row(self) -> int | None:
        """The first row after an event, as counted in the file; None for other causes."""
        return None if self.event is None else self.event.row

    @property
    def confidence(self) -> Confidence:
        return Confidence.of(self.odds)

    @property
    def label(self) -> str:
        """Short, for tables: `joint-compliance, joints 2, 3`."""
        return self.whole.label

    @property
    def plain(self) -> str:
        """In a technician's words: `joints 2 and 3 give under load`."""
        return self.whole.plain

    @cached_property
    def whole(self) -> AbstractEffect:
        """Its effects as one, for the joints that it names."""
        return without_joints(together(self.effects), self.unsure)


@beside("causes", ())
def largest_first(*causes: Cause) -> tuple[Cause, ...]:
    """Causes by what they explain of positions, those without any last."""
    return tuple(sorted(causes, key=lambda cause: -np.nan_to_num(cause.contribution_mm)))


@dataclass(frozen=True, eq=False, kw_only=True)
class ResidualMap:
    """The part of the saved model that predicts without claiming a cause.

    Args:
        effects: Smooth errors of joints, and effects too small to be causes.
        before: Held-out errors without them: of the geometry, with the causes if these alone predict better.
        after: Held-out errors with them.
        beside_causes: Whether `before` includes the causes.
    """

    effects: tuple[AbstractEffect, ...]
    before: Errors
    after: Errors
    beside_causes: bool

    @property
    def joints(self) -> tuple[int, ...]:
        return tuple(sorted({j for e in self.effects for j in e.joints}))

    @property
    def is_better(self) -> bool:
        """Whether the rows that judge it agree that it predicts."""
        return self.after.main.mean < self.before.main.mean

    @property
    def sentence(self) -> str:
        where = f" of {joint_list(self.joints)}" if self.joints else ""
        without = " with the causes alone" if self.beside_causes else ""
        before, after = (e.text("mean") for e in (self.before, self.after))
        if not self.is_better:
            said = "was fitted, but the rows that judge it are no better for it:"
            return f"A residual map{where} {said} {before}{without}, {after} with the map"
        said = "which predicts but names no cause, takes the error from"
        return f"A residual map{where}, {said} {before}{without} to {after}"


def is_named(
    causes: Sequence[Cause], residual_map: ResidualMap | None, before: Errors, after: Errors
) -> bool:
    """Whether causes, all of them at least probable, explain more of an error than a residual map does."""
    if not causes or any(cause.confidence is Confidence.OPEN for cause in causes):
        return False
    mapped = 0.0 if residual_map is None else residual_map.before.main.mean - residual_map.after.main.mean
    return not mapped > 0.5 * (before.main.mean - after.main.mean)


def together(effects: Sequence[AbstractEffect]) -> AbstractEffect:
    """Effects of one kind, merged into one of all their joints."""
    first, *others = sorted(effects, key=lambda e: e.joints)
    if not others:
        return first
    joints = tuple(j for e in (first, *others) for j in e.joints)
    sizes = tuple(c for e in (first, *others) for c in e.coefficients)
    order = np.argsort(joints)
    return replace(first, joints=tuple(joints[i] for i in order), coefficients=tuple(sizes[i] for i in order))

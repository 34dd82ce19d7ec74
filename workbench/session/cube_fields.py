"""What the cubes of the region may be coloured by: fields of a number for every cube."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from workbench.plate.cube_map import CubeMap
from workbench.session.state import NO_FIELD, PREDICTED_ERROR, CubeView, Focus, Session

CROWDED = 95.0
"""Percentile at which the colour scale of errors ends, so that a few bad cubes don't hide the rest."""
SPANS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Changes, as shares, at which the scale of a drag may end."""


@dataclass(frozen=True, eq=False)
class CubeValues:
    """A number for every cube.

    Args:
        numbers: In SI; NaN where there is none, infinite where nothing bounds it.
        low: Where the colour scale begins.
        high: Where it ends.
    """

    numbers: Float[np.ndarray, " cubes"]
    low: float
    high: float

    @classmethod
    def scaled(cls, numbers: Float[np.ndarray, " cubes"]) -> "CubeValues":
        """With a scale from the smallest to nearly the largest number."""
        finite = numbers[np.isfinite(numbers)]
        if not len(finite):
            return cls(numbers, 0.0, 1.0)
        return cls(numbers, float(finite.min()), float(np.percentile(finite, CROWDED)))

    @property
    def shares(self) -> Float[np.ndarray, " cubes"]:
        """Place on the colour scale, 0 to 1; NaN where there is no number."""
        return np.clip((self.numbers - self.low) / max(self.high - self.low, 1e-300), 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class CubeField:
    """A number for every cube of the region.

    Args:
        name: In commands and journals.
        choice: In the page's list; empty for one that nobody chooses.
        title: Heading of its colour scale.
        meaning: After its choice and a colon, for the list's hint.
        of: The numbers, from the evaluation of the cubes.
        inputs: Record of the session, beside region and cubes, that the numbers depend on.
        unit: In which its numbers are shown.
        factor: From SI to that unit.
        larger_is_better: Whether large numbers are good.
        is_signed: Whether its scale reaches equally far below and above zero.
    """

    name: str
    choice: str = ""
    title: str
    meaning: str = ""
    of: Callable[[Session, Any], CubeValues]
    inputs: Callable[[Session], object] = lambda session: None
    unit: str = "mm"
    factor: float = 1e3
    larger_is_better: bool = False
    is_signed: bool = False

    def values(self, session: Session) -> CubeValues | None:
        """The numbers; None where there are none (yet)."""
        known = cubes_of(session)
        return None if known is None else self.of(session, known)


def _predicted(session: Session, cubes: CubeMap) -> CubeValues:
    """On the scale of the first plate, so that one sees what a target's move makes better or worse."""
    now = cubes.errors(session.score.linearisation)
    first = _errors(cubes, session.history.first.score.linearisation)
    return replace(CubeValues.scaled(first if np.isfinite(first).any() else now), numbers=now)


def _predicted_change(session: Session, cubes: CubeMap) -> CubeValues:
    """How a drag has changed the predicted error.

    A move of one target changes all errors by some per cent, which a scale for their own spread would hide.
    """
    before = _errors(cubes, session.drag and session.drag.begun)
    with np.errstate(invalid="ignore"):
        shares = cubes.errors(session.score.linearisation) / before - 1.0
    finite = np.sort(np.abs(shares[np.isfinite(shares)]))
    wanted = finite[int(0.01 * CROWDED * len(finite))] if len(finite) else 0.0
    span = next((s for s in SPANS if s >= wanted), SPANS[-1])
    return CubeValues(shares, -span, span)


_errors = lru_cache(maxsize=2)(CubeMap.errors)
"""Of what is compared with again and again: the first plate, and the one that a drag began with."""
PREDICTED = CubeField(
    name=PREDICTED_ERROR,
    choice="Predicted error",
    title="Predicted error after calibration",
    meaning="after a calibration with these targets",
    of=_predicted,
    inputs=lambda session: session.score,
)
REACHABILITY = CubeField(
    name="reach",
    choice="Reachability",
    title="Reached, of the targets' orientations",
    meaning="in how many of the targets' orientations the arm reaches the centre",
    of=lambda session, cubes: CubeValues(cubes.reached / cubes.tried, 0.0, 1.0),
    unit="%",
    factor=100.0,
    larger_is_better=True,
)
BEST_INDEX = CubeField(
    name="index",
    choice="Best index O",
    title="Best index O",
    meaning="the highest of single poses there",
    of=lambda session, cubes: CubeValues.scaled(cubes.index),
    unit="",
    factor=1.0,
    larger_is_better=True,
)
CHANGE = CubeField(
    name="change",
    title="Change in predicted error during this drag",
    of=_predicted_change,
    unit="%",
    factor=100.0,
    is_signed=True,
)
CUBE_FIELDS = {field.name: field for field in (REACHABILITY, BEST_INDEX, PREDICTED)}
"""What cubes can be coloured by."""


def field_of(session: Session) -> CubeField | None:
    """The chosen field; None if the cubes are not shown."""
    return CUBE_FIELDS.get(session.region.view.field)


def drawn_field(session: Session) -> CubeField | None:
    """What the cubes are coloured by: while a target is dragged, how its move changes the predicted error."""
    field = field_of(session)
    return CHANGE if field is PREDICTED and session.drag is not None else field


def inputs(session: Session) -> tuple[object, ...]:
    """Records of the session that the colours depend on, beside region, view and drag."""
    field = field_of(session)
    return session.region.cubes, None if field is None else field.inputs(session)


def are_shown(session: Session) -> bool:
    """Whether the scene has cubes; nobody asked for those that are there at first."""
    view = session.region.view
    return view.field != NO_FIELD and (view.is_chosen or session.playback.focus is Focus.TARGET)


def shown_cubes(session: Session, view: CubeView, numbers: CubeValues) -> Bool[np.ndarray, " cubes"]:
    """Which cubes are shown: those of the kept layer."""
    if view.cut is None:
        return np.ones(len(numbers.numbers), bool)
    return np.indices(session.plate.region.shape)[view.cut].ravel() == shown_layer(session)


def shown_layer(session: Session) -> int:
    """Which layer across the cut is shown: the chosen one, or the middle one."""
    view, shape = session.region.view, session.plate.region.shape
    layers = shape[view.cut or 0]
    return min(view.layer, layers - 1) if view.is_chosen else layers // 2


def cubes_of(session: Session) -> CubeMap | None:
    """The cubes' evaluation; None until that of the present region is there."""
    cubes = session.region.cubes
    return None if cubes is None or cubes.region is not session.plate.region else cubes

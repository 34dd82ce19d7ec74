"""Plot data of effects: an increment over its driver, and the law that relates the two.

A report draws them with the same increment as observed in the measured rows. Errors of joints are shown one
element at a time; a tilt in the load's direction, along that direction; changes of many elements as one.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Insertion, Wrenches, across, own, turns
from workbench.arm.effects.law import AbstractLaw
from workbench.arm.motion import Motion
from workbench.base.columns import COLUMNS, row_drivers

CURVE_POINTS = 1500
"""Number of points of a curve over a joint's range."""


@dataclass(frozen=True, eq=False)
class DeflectedRows:
    """Rows of a deflected arm.

    Args:
        chain: With the rotations that its effects need.
        wrenches: Through every joint [N, N m]; empty if no effect needs them.
    """

    chain: Chain
    motion: Motion
    wrenches: Wrenches


@dataclass(frozen=True, eq=False)
class IncrementCurve:
    """One increment of an effect over its driver.

    Args:
        what: Quantity with its unit, such as `error of joint 3 [mrad]`.
        driver: Its driver, with its unit.
        x: The driver in every row, in that unit.
        scale: Factor from the increment's size [SI] to the unit.
        elements: Elements of the chain that it changes.
        direction: How much of each per unit of size [rad or m].
        law: Size of the increment in every row according to the effect [SI].
        curve: Driver and size [SI] of a line through the law; NaN breaks it.
        steps: Whether the driver has few distinct values, such as a direction.
    """

    what: str
    driver: str
    x: Float[np.ndarray, " rows"]
    scale: float
    elements: tuple[str, ...]
    direction: Float[np.ndarray, "rows e"]
    law: Float[np.ndarray, " rows"]
    curve: tuple[np.ndarray, np.ndarray]
    steps: bool = False


def view_of_element(
    effect: AbstractLaw,
    state: DeflectedRows,
    place: int,
    *,
    what: str,
    driver: str,
    x: Float[np.ndarray, " rows"],
    scale: float = 1e3,
) -> IncrementCurve:
    """The increment of one of an effect's elements over any driver.

    Args:
        place: Which of its elements.
        what: Quantity with its unit.
        driver: Its driver, with its unit.
        x: The driver in every row.
        scale: Factor from the increment [SI] to the unit; milliradians or millimetres by default.
    """
    law = effect.increments(state.chain, state.motion, state.wrenches)
    direction = np.zeros_like(law)
    direction[:, place] = 1.0
    return IncrementCurve(
        what=what,
        driver=driver,
        x=x,
        scale=scale,
        elements=effect.elements(state.chain),
        direction=direction,
        law=law[:, place],
        curve=line_through(x, law[:, place]),
    )


def line_through(x: np.ndarray, law: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The law as a line through the rows, broken where the driver changes sign."""
    order = np.argsort(x, kind="stable")
    x, law = x[order], law[order]
    leap = np.flatnonzero(np.diff(np.sign(x)) != 0) + 1
    return np.insert(x, leap, np.nan), np.insert(law, leap, np.nan)


def usual_views(effect: AbstractLaw, state: DeflectedRows) -> Iterator[IncrementCurve]:
    """Every increment of an effect over the driver required by its law."""
    if effect.loads and effect.insertion is Insertion.TILT:
        yield from _over_moment_across(effect, state)
    elif len(effect.elements(state.chain)) == len(effect.joints) > 0:
        for place, joint in enumerate(effect.joints):
            if not (effect.loads or {"direction", *row_drivers()} & set(effect.needs)):
                yield over_position(effect, state, place, joint)
                continue
            text, x = _driver(effect, state, joint)
            what = error_of(state, joint)
            view = view_of_element(effect, state, place, what=what, driver=text, x=x)
            yield replace(view, steps="direction" in effect.needs)
    else:
        yield _together(effect, state)


def over_position(effect: AbstractLaw, state: DeflectedRows, place: int, over: int) -> IncrementCurve:
    """The error of a joint over a joint's position; an error of that joint alone is drawn over its range."""
    turning = turns(state.chain, over)
    wide = float(np.rad2deg(1.0)) if turning else 1e3
    q = state.motion.q[:, over]
    view = view_of_element(
        effect,
        state,
        place,
        what=error_of(state, effect.joints[place]),
        driver=f"{'angle' if turning else 'position'} of joint {over + 1} [{'°' if turning else 'mm'}]",
        x=wide * q,
    )
    if not effect.maps_joint:
        order = np.argsort(q, kind="stable")
        return replace(view, curve=(view.x[order], view.law[order]))
    grid = np.linspace(q.min(), q.max(), CURVE_POINTS)
    motion = Motion(np.repeat(grid[:, None], state.chain.dof, axis=1))
    return replace(view, curve=(wide * grid, effect.increments(state.chain, motion)[:, place]))


def error_of(state: DeflectedRows, joint: int) -> str:
    """Label of a joint's error."""
    return f"error of joint {joint + 1} [{'mrad' if turns(state.chain, joint) else 'mm'}]"


def _driver(effect: AbstractLaw, state: DeflectedRows, joint: int) -> tuple[str, np.ndarray]:
    """Driver of a joint's error, with its unit, and its value in every row."""
    for name in effect.needs:
        if name == "direction":
            text = f"direction of the last motion of joint {joint + 1}"
            return text, state.motion.need(name, effect.name)[:, joint]
        if name in row_drivers():
            return COLUMNS[name].label, COLUMNS[name].shown[1] * state.motion.need(name, effect.name)
    load, unit = ("moment about", "N·m") if turns(state.chain, joint) else ("force along", "N")
    text = f"{load} the axis of joint {joint + 1} [{unit}]"
    return text, own(state.chain, [joint], state.wrenches)[:, 0]


def _over_moment_across(effect: AbstractLaw, state: DeflectedRows) -> Iterator[IncrementCurve]:
    """Tilts over the moment across the axis, along its direction."""
    law = effect.increments(state.chain, state.motion, state.wrenches)
    for place, joint in enumerate(effect.joints):
        moment = across(state.chain, [joint], state.wrenches)[:, 0]
        size = np.linalg.norm(moment, axis=1)
        direction = np.zeros_like(law)
        direction[:, 2 * place : 2 * place + 2] = -moment / np.where(size > 0.0, size, 1.0)[:, None]
        along = (law * direction).sum(1)
        yield IncrementCurve(
            what=f"tilt of joint {joint + 1} in the load's direction [mrad]",
            driver=f"moment across the axis of joint {joint + 1} [N·m]",
            x=size,
            scale=1e3,
            elements=effect.elements(state.chain),
            direction=direction,
            law=along,
            curve=line_through(size, along),
        )


def _together(effect: AbstractLaw, state: DeflectedRows) -> IncrementCurve:
    """All increments of a row as one, along the direction in which the effect moves them."""
    law = effect.increments(state.chain, state.motion, state.wrenches)
    size = np.linalg.norm(law, axis=1)
    driver, x = f"contribution of {effect.name} [mrad or mm]", 1e3 * size
    if row_drivers().keys() & set(effect.needs):
        driver, x = _driver(effect, state, 0)
    return IncrementCurve(
        what=f"{effect.name} [mrad or mm]",
        driver=driver,
        x=x,
        scale=1e3,
        elements=effect.elements(state.chain),
        direction=law / np.where(size > 0.0, size, 1.0)[:, None],
        law=size,
        curve=line_through(x, size),
    )

"""Effects against what drives them: which increment to look at, over which driver, and the law between them.

Joint errors are looked at one element at a time; a tilt of which the load decides the direction, along that
direction; thermal growth as the growth of all lengths together.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.backlash import Backlash
from workbench.arm.effects.base_drift import PARTS, BaseDrift
from workbench.arm.effects.bearing_compliance import BearingCompliance
from workbench.arm.effects.clearance_tilt import ClearanceTilt
from workbench.arm.effects.effect import across, own, turns
from workbench.arm.effects.encoder_scale import EncoderScale
from workbench.arm.effects.gravity_sag import GravitySag
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.arm.effects.link_flexure import LinkFlexure
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.arm.effects.thermal_growth import ThermalGrowth
from workbench.arm.motion import Motion
from workbench.diagnosis.report.apparent import Rows

GRID = 1500
"""Points of a curve over a joint's range."""
DRIFTS = {"m/s": ("mm", 1e3), "rad/s": ("mrad", 1e3)}


@dataclass(frozen=True, eq=False)
class View:
    """One increment of an effect over its driver.

    Args:
        what: What is seen, with its unit, such as `error of joint 3 [mrad]`.
        driver: What drives it, with its unit.
        x: The driver in every row, in that unit.
        scale: What turns the increment's size [SI] into the unit.
        elements: Elements of the chain that it changes.
        direction: How much of each per unit of size [rad or m].
        law: Size of the increment in every row as the effect has it [SI].
        curve: Driver and size [SI] of a line through the law; NaN breaks it.
        steps: Whether the driver has but a few values, such as a direction.
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


def views(effect: AbstractEffect, rows: Rows) -> tuple[View, ...]:
    """Every increment of an effect over its driver."""
    return tuple(VIEWS[type(effect)](effect, rows))


def _law(effect: AbstractEffect, rows: Rows) -> np.ndarray:
    """Increments (rows, elements) [rad or m]."""
    return effect.law(rows.chain, rows.motion, rows.wrenches) @ np.array(effect.coefficients)


def _sorted(x: np.ndarray, law: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The law as a line through the rows, broken where its sign leaps."""
    order = np.argsort(x, kind="stable")
    x, law = x[order], law[order]
    leap = np.flatnonzero(np.diff(np.sign(x)) != 0) + 1
    return np.insert(x, leap, np.nan), np.insert(law, leap, np.nan)


def _unit(size: int, place: int, rows: int) -> np.ndarray:
    out = np.zeros((rows, size))
    out[:, place] = 1.0
    return out


def _joint_unit(rows: Rows, joint: int) -> tuple[str, float]:
    """Unit and scale of a joint's error."""
    return ("mrad", 1e3) if turns(rows.chain, joint) else ("mm", 1e3)


def _place(rows: Rows, joint: int) -> tuple[str, float]:
    """Name and scale of a joint's position."""
    if turns(rows.chain, joint):
        return f"angle of joint {joint + 1} [°]", float(np.rad2deg(1.0))
    return f"position of joint {joint + 1} [mm]", 1e3


def of_joint_position(effect: AbstractEffect, rows: Rows) -> Iterator[View]:
    """Errors of joints over their own position, or over another joint's."""
    law = _law(effect, rows)
    coupled = isinstance(effect, JointCoupling)
    for place, joint in enumerate(effect.joints[:1] if coupled else effect.joints):
        over = effect.joints[1] if coupled else joint
        q = rows.motion.q[:, over]
        grid = np.linspace(q.min(), q.max(), GRID)
        motion = Motion(np.repeat(grid[:, None], rows.chain.dof, axis=1))
        shape = effect.law(rows.chain, motion, rows.wrenches) @ np.array(effect.coefficients)
        unit, scale = _joint_unit(rows, joint)
        name, wide = _place(rows, over)
        yield View(
            what=f"error of joint {joint + 1} [{unit}]",
            driver=name,
            x=wide * q,
            scale=scale,
            elements=effect.elements(rows.chain),
            direction=_unit(law.shape[1], place, len(law)),
            law=law[:, place],
            curve=(wide * grid, shape[:, place]),
        )


def of_own_moment(effect: AbstractEffect, rows: Rows) -> Iterator[View]:
    """Errors of joints over the moment about their axis, or over the direction of their last motion."""
    law = _law(effect, rows)
    for place, joint in enumerate(effect.joints):
        unit, scale = _joint_unit(rows, joint)
        x, driver, steps = _cause(effect, rows, joint)
        yield View(
            what=f"error of joint {joint + 1} [{unit}]",
            driver=driver,
            x=x,
            scale=scale,
            elements=effect.elements(rows.chain),
            direction=_unit(law.shape[1], place, len(law)),
            law=law[:, place],
            curve=_sorted(x, law[:, place]),
            steps=steps,
        )


def _cause(effect: AbstractEffect, rows: Rows, joint: int) -> tuple[np.ndarray, str, bool]:
    if getattr(effect, "by", "") == "motion":
        words = f"direction of the last motion of joint {joint + 1}"
        return rows.motion.need("direction", str(effect.name))[:, joint], words, True
    turning = turns(rows.chain, joint)
    words = "moment about the axis" if turning else "force along the axis"
    moment = own(rows.chain, [joint], rows.wrenches)[:, 0]
    return moment, f"{words} of joint {joint + 1} [{'N·m' if turning else 'N'}]", False


def of_weight(effect: GravitySag, rows: Rows) -> Iterator[View]:
    """The joint's error over what the weights behind it make of it, which takes many angles to say."""
    joint, law = effect.joints[0], _law(effect, rows)
    yield View(
        what=f"error of joint {joint + 1} [mrad]",
        driver=f"sag of joint {joint + 1} by the weights behind it [mrad]",
        x=1e3 * law[:, 0],
        scale=1e3,
        elements=effect.elements(rows.chain),
        direction=np.ones_like(law),
        law=law[:, 0],
        curve=_sorted(1e3 * law[:, 0], law[:, 0]),
    )


def of_cross_moment(effect: AbstractEffect, rows: Rows) -> Iterator[View]:
    """Tilts over the moment across the axis, along the direction in which it pushes."""
    law = _law(effect, rows)
    for place, joint in enumerate(effect.joints):
        moment = across(rows.chain, [joint], rows.wrenches)[:, 0]
        size = np.linalg.norm(moment, axis=1)
        push = -moment / np.where(size > 0.0, size, 1.0)[:, None]
        direction = np.zeros_like(law)
        direction[:, 2 * place : 2 * place + 2] = push
        along = (law * direction).sum(1)
        yield View(
            what=f"tilt of joint {joint + 1}, the way the load pushes [mrad]",
            driver=f"moment across the axis of joint {joint + 1} [N·m]",
            x=size,
            scale=1e3,
            elements=effect.elements(rows.chain),
            direction=direction,
            law=along,
            curve=_sorted(size, along),
        )


def of_link(effect: AbstractEffect, rows: Rows) -> Iterator[View]:
    """Bending of a link about each of its two axes over the moment that it carries about them."""
    laws, law = effect.law(rows.chain, rows.motion, rows.wrenches), _law(effect, rows)
    for place in range(law.shape[1]):
        joint, axis = effect.joints[place // 2], place % 2 + 1
        x = -laws[:, place, place]
        yield View(
            what=f"bending {axis} of the link after joint {joint + 1} [mrad]",
            driver=f"moment {axis} across the link after joint {joint + 1} [N·m]",
            x=x,
            scale=1e3,
            elements=effect.elements(rows.chain),
            direction=_unit(law.shape[1], place, len(law)),
            law=law[:, place],
            curve=_sorted(x, law[:, place]),
        )


def of_temperature(effect: ThermalGrowth, rows: Rows) -> Iterator[View]:
    """Growth of all lengths together over the temperature."""
    warm = rows.motion.need("temperature", str(effect.name))
    warmer = replace(rows.motion, temperature=np.full(len(warm), effect.reference + 1.0))
    lengths = effect.law(rows.chain, warmer, rows.wrenches)[..., 0]
    law = effect.coefficients[0] * (warm - effect.reference)
    yield View(
        what="growth of all lengths [µm/m]",
        driver="temperature [°C]",
        x=warm,
        scale=1e6,
        elements=effect.elements(rows.chain),
        direction=lengths,
        law=law,
        curve=_sorted(warm, law),
    )


def of_time(effect: BaseDrift, rows: Rows) -> Iterator[View]:
    """Creep of the measuring frame over time, in each of its six ways."""
    law = _law(effect, rows)
    minutes = (rows.motion.need("time", str(effect.name)) - effect.reference) / 60.0
    for place, (part, speed) in enumerate(PARTS):
        unit, scale = DRIFTS[speed]
        yield View(
            what=f"drift of {part} [{unit}]",
            driver="time [min]",
            x=minutes,
            scale=scale,
            elements=effect.elements(rows.chain),
            direction=_unit(law.shape[1], place, len(law)),
            law=law[:, place],
            curve=_sorted(minutes, law[:, place]),
        )


VIEWS: dict[type[AbstractEffect], Callable[..., Iterator[View]]] = {
    JointHarmonic: of_joint_position,
    EncoderScale: of_joint_position,
    LocalJointError: of_joint_position,
    JointCoupling: of_joint_position,
    JointCompliance: of_own_moment,
    Backlash: of_own_moment,
    BearingCompliance: of_cross_moment,
    ClearanceTilt: of_cross_moment,
    LinkFlexure: of_link,
    GravitySag: of_weight,
    ThermalGrowth: of_temperature,
    BaseDrift: of_time,
}
"""How each effect of the catalogue is looked at; a new effect is one more entry."""

"""Effects in plain words."""

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.effect import turns
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.arm.motion import Motion

NO_WRENCHES = np.zeros((0, 0, 6))
LARGEST = 3
"""Orders of a band that are named."""
READABLE = {
    "rad": (1e3, "mrad"),
    "m": (1e3, "mm"),
    "1": (1e2, "%"),
    "rad/(N*m)": (1e3, "mrad/(N·m)"),
    "m/N": (1e6, "µm/N"),
    "1/K": (1e6, "µm/(m·K)"),
    "m/s": (3.6e6, "mm/h"),
    "rad/s": (3.6e6, "mrad/h"),
    "rad/m": (1.0, "mrad/mm"),
    "m/rad": (1.0, "mm/mrad"),
}
"""Factor and name of the unit that stands for an SI unit."""


def label(effect: AbstractEffect) -> str:
    """Short, for tables: `joint-harmonic, joint 3, order 2`."""
    joints = [str(j + 1) for j in effect.joints]
    words = [str(effect.name)]
    if joints:
        words.append(f"joint{'s' if len(joints) > 1 else ''} {' by '.join(joints)}")
    if isinstance(effect, JointHarmonic):
        orders = effect.orders
        words.append(f"order {orders[0]}" if len(orders) == 1 else f"orders {orders[0]}–{orders[-1]}")
    if getattr(effect, "by", None) == "motion":
        words.append("by motion")
    return ", ".join(words)


def sentence(effect: AbstractEffect, chain: Chain, motion: Motion) -> str:
    """What an effect with its coefficients does on some rows."""
    who = f"joint {effect.joints[0] + 1}" if effect.joints else "the arm"
    maps = isinstance(effect, JointHarmonic | LocalJointError)
    size = _amplitude(effect, chain, motion) if maps else _size(effect, chain)
    slides = [not turns(chain, j) for j in effect.joints]
    match str(effect.name):
        case "joint-compliance":
            load = "force along" if slides[0] else "moment about"
            text = f"{who} gives way by {size} under the {load} its axis"
        case "gravity-sag":
            text = (
                f"{who} gives way to the weight behind it, by products of compliance and weight up to {size}"
            )
        case "backlash":
            cause = "its last motion" if getattr(effect, "by", "") == "motion" else "its load"
            text = f"{who} has play: it lies {size} to either side, as {cause} decides"
        case "clearance-tilt":
            text = f"the bearing of {who} is loose: the link tips over by {size}, the way the load pushes it"
        case "bearing-compliance":
            text = f"the bearing of {who} tips over by {size} under the moment across its axis"
        case "link-flexure":
            text = f"the link after {who} bends by {size} under the moment that it carries"
        case "joint-harmonic" if isinstance(effect, JointHarmonic):
            text = f"{who} strays by {size} {_times(effect)}"
        case "encoder-scale":
            far = "far" if effect.coefficients[0] > 0 else "little"
            text = f"{who} {'slides' if slides[0] else 'turns'} {size} too {far}"
        case "joint-coupling":
            way = "travel" if slides[1] else "angle"
            text = f"{who} moves along with joint {effect.joints[1] + 1}: {size} of its {way}"
        case "thermal-growth":
            text = f"the lengths grow with the temperature: {size}"
        case "base-drift":
            text = f"the measuring frame creeps with time: {size}"
        case _:
            text = f"{who} has a smooth error of its own of up to {size} that fits no other name"
    return text[0].upper() + text[1:]


def _times(effect: JointHarmonic) -> str:
    """How often a turn."""
    orders = effect.orders
    if len(orders) == 1:
        return {1: "once per turn", 2: "twice per turn"}.get(orders[0], f"{orders[0]} times per turn")
    pairs = np.array(effect.coefficients).reshape(len(effect.joints), len(orders), 2)
    strength = np.hypot(pairs[..., 0], pairs[..., 1]).max(0)
    largest = sorted(orders[i] for i in np.argsort(-strength)[:LARGEST])
    return f"many times per turn, most at {', '.join(map(str, largest))}"


def _size(effect: AbstractEffect, chain: Chain) -> str:
    """Its largest coefficient in readable units."""
    values = np.abs(effect.coefficients)
    match str(effect.name):
        case "gravity-sag":
            pairs = zip(effect.names, values, strict=True)
            angles = [float(v) for name, v in pairs if name[-1] in "xyz"]
            return _readable(max(angles, default=0.0), "rad")
        case "thermal-growth":
            return _readable(effect.coefficients[0], _unit(effect, chain))
        case "base-drift":
            speed, turning = np.linalg.norm(values[:3]), np.linalg.norm(values[3:])
            return f"{3.6e6 * speed:.3g} mm/h and {3600 * np.rad2deg(turning):.2g} °/h"
        case _:
            largest = int(np.argmax(values))
            return _readable(float(values[largest]), _unit(effect, chain, largest))


def _unit(effect: AbstractEffect, chain: Chain, place: int = 0) -> str:
    """SI unit of a coefficient."""
    return effect.units(chain)[place]


def _readable(value: float, unit: str) -> str:
    """A coefficient in the unit that people read."""
    factor, name = READABLE.get(unit, (1.0, unit))
    return f"{factor * value:.3g} {name}"


def _amplitude(effect: AbstractEffect, chain: Chain, motion: Motion) -> str:
    """Greatest deviation of a joint's error from its mean over the measured rows."""
    error = (effect.law(chain, motion, NO_WRENCHES) @ np.array(effect.coefficients))[:, 0]
    return _readable(float(np.abs(error - error.mean()).max()), _unit(effect, chain))

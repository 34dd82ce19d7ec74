"""Hidden effects of virtual arms, and the state in which they are measured.

    NAME[:joint[:size]]      joint-compliance:2:4e-5, backlash:3, thermal-growth

A size is the maximum coefficient, in the effect's own SI unit. Without one, the effect bends an element of
the arm by at most `MAX_BEND` over random joint positions (and an hour), or grows as aluminium does. What
drives the effects (loads, temperature, time, direction of motion) varies from row to row, each by itself.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import EFFECTS, AbstractEffect
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.base.columns import COLUMNS
from workbench.base.errors import OptionError
from workbench.data.readers.headings import number_in

MAX_BEND = 1e-3
"""Largest bend of an element where no size is given [rad or m]."""
BEND_SAMPLES = 120
"""Random joint positions at which the largest bend is sought."""
MIN_LAW = 1e-6
"""Largest law (a moment, an angle …) below which an effect can't be seen."""
ROW_INTERVAL = 30.0
"""Time from one row to the next [s]."""
PAYLOAD_SHARES = (0.0, 0.05, 0.1)
"""Payloads, as shares of the arm's own mass."""


def hidden_effects(
    robot: Robot, wanted: Sequence[str | AbstractEffect], *, rng: np.random.Generator
) -> tuple[tuple[AbstractEffect, ...], tuple[str, ...]]:
    """Effects to hide in an arm.

    Args:
        wanted: Effects as they are, or in words, `NAME[:joint[:size]]` with joints from 1.
        rng: Source of what is not said: phases, directions, the shape of a local joint error.

    Returns:
        The effects with their coefficients, and a sentence on each.
    """
    effects = tuple(e if isinstance(e, AbstractEffect) else _from_text(robot, e, rng) for e in wanted)
    robot.with_effects(*effects)
    return effects, tuple(_sentence(robot, effect) for effect in effects)


def varied_state(robot: Robot, q: Float[np.ndarray, "rows n"], *, rng: np.random.Generator) -> Motion:
    """Joint positions with whatever drives the robot's effects; nothing else."""
    drivers, rows = dict[str, np.ndarray](), len(q)
    for effect in robot.effects:
        if effect.loads and robot.has_masses:
            mass = sum(joint.mass or 0.0 for joint in robot.joints)
            drivers["payload"] = np.round(rng.choice(PAYLOAD_SHARES, rows) * mass, 2)
        for name in effect.needs:
            if name in COLUMNS and (usual := COLUMNS[name].usual) is not None:
                turns = rng.uniform(1.3, 1.7) * np.arange(rows) / max(rows, 1) + rng.uniform()
                drivers[name] = usual[0] + usual[1] * np.sin(2.0 * np.pi * turns)
        if "time" in effect.needs:
            drivers["time"] = ROW_INTERVAL * np.arange(rows) + rng.uniform(0.0, 0.1 * ROW_INTERVAL, rows)
        if "direction" in effect.needs:
            drivers["direction"] = rng.choice([-1.0, 1.0], q.shape)
    return Motion.with_drivers(q, {"row": np.arange(rows), **drivers})


def _from_text(robot: Robot, text: str, rng: np.random.Generator) -> AbstractEffect:
    name, joint, size = (*text.split(":", 2), "", "")[:3]
    if name not in EFFECTS:
        raise OptionError(f"unknown effect '{name}'; known: {', '.join(EFFECTS)}")
    kind = EFFECTS[name]
    given = joint or str(min(kind.usual_joint, robot.dof - 1) % robot.dof + 1)
    if not given.isdecimal() or not 1 <= int(given) <= robot.dof or (joint and kind.whole_arm):
        known = f"left out ({name}::SIZE): it concerns the whole arm" if kind.whole_arm else f"1–{robot.dof}"
        raise OptionError(f"effect '{text}': joint must be {known}, got '{joint}'")
    effect = kind.example(robot, int(given) - 1, rng)
    bent = robot.with_effects(effect).with_effects(_scaled(effect, 1e-6))
    low, high = bent.search_limits.T
    q = rng.uniform(low, high, (BEND_SAMPLES, bent.dof))
    bend = 1e6 * float(np.abs(shift_of(bent, varied_state(bent, q, rng=rng))).max())
    if bend < MIN_LAW:
        raise OptionError(f"effect '{text}': nothing drives it at that joint; choose another joint")
    factor = number_in(size) if size else effect.typical_size or MAX_BEND / bend
    if not np.isfinite(factor) or factor == 0.0:
        raise OptionError(f"effect '{text}': the size must be a number other than 0 (SI units), got '{size}'")
    return _scaled(effect, factor)


def _scaled(effect: AbstractEffect, factor: float) -> AbstractEffect:
    return replace(effect, coefficients=tuple(factor * c for c in effect.coefficients))


def _sentence(robot: Robot, effect: AbstractEffect) -> str:
    units = ["" if unit == "1" else f" {unit}" for unit in effect.units(robot.chain)]
    known = zip(effect.names, effect.coefficients, units, strict=True)
    sizes = ", ".join(f"{name} {value:.3g}{unit}" for name, value, unit in known)
    values = ((name, getattr(effect, name)) for name in effect.settings())
    words = (f", {name} {v}" for name, v in values if isinstance(v, str | int) and not isinstance(v, bool))
    return f"hidden effect '{effect.name}'{''.join(words)}: {sizes}"

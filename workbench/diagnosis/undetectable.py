"""Load effects that are undetectable in the rows, and how much they may bias the sizes of those found.

Beside an accepted model with columns A, the coefficient c of another effect with column a would be estimated
as ĉ with the standard error

    σ = s / |a − A A⁺ a|,      s the standard deviation of a whitened residual

An undetected effect biases the found coefficients by A⁺ a c. Effects of one kind are about as large as the
largest one found, d, so that with the weight w = d²/(d² + σ²) the expected square of c is (w ĉ)² + w σ², and
the variances of the found coefficients increase by (A⁺ a)² times that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects import AbstractEffect, Candidate, Loads
from workbench.arm.effects.axes import across, own, turns
from workbench.arm.statics.wrenches import motion_wrenches
from workbench.base.advice import beside
from workbench.base.wording import joint_list
from workbench.diagnosis.drivers.evidence import in_words
from workbench.diagnosis.search.evidence import coefficients, curvature, left_by
from workbench.diagnosis.search.rounds import Searched

DETECTABLE_ERRORS = 6.0
"""Size in standard errors that makes an effect certain to be found, by evidence and by all folds …"""
MIN_SIZE_SHARE = 0.5
"""… if its size is this share of the largest one found."""
MIN_DISTINCT_SHARE = 0.01
"""Share of a column's square left by the model below which both are indistinguishable."""
MIN_MOMENT = 0.01
"""Root mean square of a moment, relative to the arm's maximum, below which the joint is unloaded."""


class Reason(StrEnum):
    """Why an effect is undetectable."""

    UNLOADED = "not loaded in any row"
    COVERED = "indistinguishable from the rest of the model"
    FAINT = "too small to stand out from the noise"


@dataclass(frozen=True, eq=False)
class Undetectable:
    """An effect that is undetectable in the rows.

    Args:
        effect: With a coefficient of zero.
        reason: Why it is undetectable.
        std: Standard error that its coefficient would have [SI]; infinite if not loaded.
        size: Root of the expected square of its coefficient [SI]; 0 if not loaded.
    """

    effect: AbstractEffect
    reason: Reason
    std: float
    size: float = 0.0


def undetectable(searched: Searched) -> tuple[Undetectable, ...]:
    """Effects of load that may exist but would not have been found by a last search, at the final fit."""
    chain = searched.stage.fit.arm.chain
    idle, found = _idle(searched), _largest_found(searched, chain)
    left = left_by(searched.grams, searched.model)
    noise = np.sqrt(left.square / max(left.freedom, 1))
    out = []
    for candidate in _loads_at_one_joint(searched):
        (column,) = mine = searched.grams.columns(candidate.names)
        (scale,) = searched.grams.scales(candidate.names)
        whole, alone = searched.grams.total[column, column], float(left.inner(mine)[0, 0])
        std = float(noise / (np.sqrt(alone) * scale)) if alone > 0.0 else np.inf
        kind, (unit,) = candidate.effect.name, candidate.effect.units(chain)
        size = found.get(kind, found.get(unit, 0.0))
        if candidate.names[0] in idle:
            out.append(Undetectable(candidate.effect, Reason.UNLOADED, np.inf))
        elif DETECTABLE_ERRORS * std > MIN_SIZE_SHARE * size > 0.0:
            reason = Reason.COVERED if alone < MIN_DISTINCT_SHARE * whole else Reason.FAINT
            weight = size**2 / (size**2 + std**2)
            own = left.along(mine)[0] / (alone * scale) if weight > 0.0 else 0.0
            expected = np.sqrt((weight * own) ** 2 + size**2 * (1.0 - weight))
            out.append(Undetectable(candidate.effect, reason, std, float(expected)))
    return tuple(out)


@beside("the share of undetectable effects in standard errors", {})
def hidden_variance(searched: Searched, missing: Sequence[Undetectable]) -> dict[str, float]:
    """Additional variance of the found coefficients due to effects hidden in the noise [SI²].

    Effects that are indistinguishable from the rest of the model are not included.
    """
    grams, model = searched.grams, searched.model
    names = [n for t in model for n in t.candidate.names]
    total = dict.fromkeys(names, 0.0)
    faint = [u for u in missing if u.reason is Reason.FAINT]
    if not names or not faint:
        return total
    solve, _ = curvature(grams, model)
    used = np.concatenate([np.arange(grams.geometry), grams.columns(names)])
    for item in faint:
        (column,), (scale,) = grams.columns(item.effect.names), grams.scales(item.effect.names)
        moved = solve(grams.total[used, column])[grams.geometry :] * scale / grams.scales(names)
        for name, change in zip(names, moved * item.size, strict=True):
            total[name] += float(change**2)
    return total


@beside("the note on undetectable effects", "")
def describe(missing: Sequence[Undetectable]) -> str:
    """One sentence on the undetectable effects; empty if there are none."""
    groups: dict[tuple[Reason, tuple[int, ...]], list[str]] = {}
    joints: dict[tuple[Reason, str], list[int]] = {}
    for item in missing:
        joints.setdefault((item.reason, item.effect.name), []).append(item.effect.joints[0])
    for (reason, name), which in joints.items():
        groups.setdefault((reason, tuple(which)), []).append(name)
    known = groups.items()
    parts = [f"{in_words(names)} of {joint_list(which)} ({why})" for (why, which), names in known]
    return f"not detectable in these rows: {'; '.join(parts)}" if parts else ""


@beside("the note on undecided flanks", "")
def open_flanks_text(loads: Mapping[int, tuple[float, float]], chain: Chain) -> str:
    """Joints whose flank is undecided below some load, in a share of the rows, as one sentence."""
    parts = [
        f"joint {j + 1} below {load:.2g} {'N·m' if turns(chain, j) else 'N'} ({part:.0%} of the poses)"
        for j, (load, part) in sorted(loads.items())
    ]
    return f"With little load, it is open on which side of its backlash a joint rests: {', '.join(parts)}."


def _loads_at_one_joint(searched: Searched) -> list[Candidate]:
    """Load candidates at one joint, with one coefficient, that are not in the model."""
    taken = {n for t in searched.model for n in t.candidate.names}
    return [
        c
        for c in searched.offered.candidates
        if c.effect.loads and len(c.effect.joints) == len(c.names) == 1 and not taken & set(c.names)
    ]


def _largest_found(searched: Searched, chain: Chain) -> dict[str, float]:
    """Largest coefficients of the load effects found, by kind and by unit."""
    found, out = coefficients(searched.grams, searched.model), dict[str, float]()
    for effect in (t.candidate.effect for t in searched.model if t.candidate.effect.loads):
        for name, unit in zip(effect.names, effect.units(chain), strict=True):
            for key in (effect.name, unit):
                out[key] = max(out.get(key, 0.0), abs(found[name]))
    return out


def _idle(searched: Searched) -> set[str]:
    """Coefficients of effects whose moments are negligible."""
    robot = searched.stage.fit.arm
    if not robot.has_masses:
        return set()
    wrenches, joints = motion_wrenches(robot, searched.stage.motion), range(robot.dof)
    about = np.sqrt((own(robot.chain, joints, wrenches) ** 2).mean(0))
    tipping = np.sqrt((across(robot.chain, joints, wrenches) ** 2).sum(-1).mean(0))
    minimum = MIN_MOMENT * max(about.max(), tipping.max())
    size = {Loads.OWN: about, Loads.ALL: tipping}
    found = ((c.names[0], c.effect) for c in _loads_at_one_joint(searched))
    return {name for name, effect in found if size[effect.loads][effect.joints[0]] < minimum}

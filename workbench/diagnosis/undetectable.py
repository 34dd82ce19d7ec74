"""Load effects that may exist but would not have been found in the rows.

Beside an accepted model with columns A, the coefficient of another effect with column a has the error

    σ = s / |a − A A⁺ a|,      s the standard deviation of a whitened residual

Effects of one unit are about as large as the largest one found: one of half that size must stand out from σ.
"""

from collections.abc import Mapping

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import turns
from workbench.base.advice import beside
from workbench.base.wording import joint_list
from workbench.diagnosis.drivers.evidence import in_words
from workbench.diagnosis.search.evidence import coefficients, left_by
from workbench.diagnosis.search.rounds import Searched

DETECTABLE_ERRORS = 6.0
"""Size in standard errors that makes an effect certain to be found, by evidence and by all folds …"""
MIN_SIZE_SHARE = 0.5
"""… if its size is this share of the largest one found."""


@beside("the note on undetectable effects", "")
def undetectable(searched: Searched) -> str:
    """Effects of load at one joint, with one coefficient, that a last search would not have found, as one
    sentence; empty if there are none."""
    chain, grams = searched.stage.fit.arm.chain, searched.grams
    found, largest = coefficients(grams, searched.model), dict[str, float]()
    for effect in (t.candidate.effect for t in searched.model if t.candidate.effect.loads):
        for name, unit in zip(effect.names, effect.units(chain), strict=True):
            largest[unit] = max(largest.get(unit, 0.0), abs(found[name]))
    left, joints = left_by(grams, searched.model), dict[str, list[int]]()
    noise = np.sqrt(left.square / max(left.freedom, 1))
    for effect in (c.effect for c in searched.offered.candidates):
        if not effect.loads or not len(effect.joints) == len(effect.names) == 1 or effect.names[0] in found:
            continue
        alone = float(left.inner(grams.columns(effect.names))[0, 0])
        std = float(noise / (np.sqrt(alone) * grams.scales(effect.names)[0])) if alone > 0.0 else np.inf
        if DETECTABLE_ERRORS * std > MIN_SIZE_SHARE * largest.get(effect.units(chain)[0], 0.0) > 0.0:
            joints.setdefault(effect.name, []).extend(effect.joints)
    kinds = dict[tuple[int, ...], list[str]]()
    for name, which in joints.items():
        kinds.setdefault(tuple(which), []).append(name)
    parts = [f"{in_words(names)} of {joint_list(which)}" for which, names in kinds.items()]
    return f"not detectable in these rows: {'; '.join(parts)}" if parts else ""


@beside("the note on undecided flanks", "")
def open_flanks_text(loads: Mapping[int, tuple[float, float]], chain: Chain) -> str:
    """Joints whose flank is undecided below some load, in a share of the rows, as one sentence."""
    parts = [
        f"joint {j + 1} below {load:.2g} {'N·m' if turns(chain, j) else 'N'} ({part:.0%} of the poses)"
        for j, (load, part) in sorted(loads.items())
    ]
    return f"With little load, it is open on which side of its backlash a joint rests: {', '.join(parts)}."

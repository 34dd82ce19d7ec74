"""Plate and arm against the wanted error: one answer to each question, the same in strip, panels and report.

The plate is judged by its yield on virtual arms, the arm by its held-out rows; until these are known, nothing
is called good: the tone is plain.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from workbench.identification.run import judge
from workbench.report.blocks import Sentence, Tone
from workbench.session.state import Session

PASSING_SHARE = 0.95
"""Share of virtual arms that have to keep the wanted error."""


def plate_judgement(session: Session) -> Sentence | None:
    """Whether arms that are calibrated on this plate keep the wanted error; None where nothing is to judge.

    A predicted rms over poses can show that they don't, but not that they do at every pose.
    """
    wanted, score, found = session.choices.wanted, session.score, session.tried
    if wanted is None or np.isnan(score.position):
        return None
    if found is not None:
        kept = f"{100 * found.share:.3g} % of {found.arms} virtual arms stay within {wanted.text}"
        kept += f"; {100 * PASSING_SHARE:.0f} % of them should"
        if found.share < PASSING_SHARE:
            turned = None if wanted.rotation is None else found.used * wanted.rotation
            limit = replace(wanted, position=found.used * wanted.position, rotation=turned)
            kept += f", and do within {limit.text}"
        if found.unreached > (1.0 - PASSING_SHARE) * found.arms:
            kept += f"; {found.unreached} of them leave out targets that they can't reach"
        kept += " (geometry alone)"
        return Sentence(kept, tone=Tone.GOOD if found.share >= PASSING_SHARE else Tone.CAREFUL)
    if not wanted.within_by_norms(score.position, score.rotation):
        return Sentence(f"more than the required {wanted.text}", tone=Tone.CAREFUL)
    return Sentence(f"not yet tried against the required {wanted.text}")


def arm_judgement(session: Session) -> Sentence | None:
    """Whether the arm of the shown fit keeps the wanted error; None where nothing is to judge."""
    found, wanted = session.results.identification, session.choices.wanted
    if found is None or wanted is None:
        return None
    judged = _judged(found.runs[session.results.fit], wanted)
    if judged.is_kept is None:
        return None
    passed = Tone.GOOD if judged.held_out else Tone.PLAIN
    return Sentence(judged.verdict, tone=passed if judged.is_kept else Tone.BAD)


_judged = lru_cache(maxsize=2)(judge)

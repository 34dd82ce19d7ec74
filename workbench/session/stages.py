"""Errors stage by stage: the nominal arm, its geometry identified, its causes added; arm and plate against
the wanted error: one answer to each question, the same in strip, panels and report.

The plate is judged by its yield on virtual arms, the arm by its held-out rows; until these are known, nothing
is called good: the tone is plain.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from workbench.base.wording import first_of
from workbench.diagnosis.report.document import LEARNED, budget_bars
from workbench.diagnosis.result import Diagnosis
from workbench.identification.errors.row_errors import AbstractValidation, Errors
from workbench.identification.result import Identification
from workbench.identification.run import judge
from workbench.report.blocks import Sentence, Tone
from workbench.report.numbers import compared
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.state import Session

MAX_NAMED = 3
NORM_OF_NOISE = float(np.sqrt(8.0 / np.pi))
"""Mean length of a position error of three normal components of unit deviation."""


@dataclass(frozen=True, eq=False)
class StageErrors:
    """Errors up to one stage of the model on held-out rows; on the fitted ones where none were held out.

    Args:
        title: The stage.
        words: What the model has by then, for people.
    """

    title: ModelStage
    words: str
    errors: Errors

    @property
    def error(self) -> float:
        """Mean position error [mm]."""
        return self.errors.position_mm.mean


def suspects(session: Session) -> list[int]:
    """Numbers of the held-out rows that no arm explains."""
    found, diagnosis = session.results.identification, session.results.diagnosis
    rows = [] if diagnosis is None else diagnosis.held_out_data.row[diagnosis.suspects].tolist()
    return sorted({*rows, *(() if found is None else found.suspects)})


def sure_errors(session: Session, found: Identification) -> Errors:
    """Those of the shown fit without suspects: one wrong row would shape their mean, and what is advised."""
    return found.runs[session.results.fit].without(np.isin(found.held_out_data.row, suspects(session)))


def without_suspects(session: Session) -> str:
    """Behind a mean: ` (0.086 without row 15, which no arm explains)`; empty where there is no such row."""
    rows, found = suspects(session), session.results.identification
    if not rows or found is None:
        return ""
    named = first_of(map(session.measurements.row_name, rows), MAX_NAMED)
    left = compared(sure_errors(session, found).position_mm.mean)
    return f" ({left} without row{'s' * (len(rows) > 1)} {named}, which no arm explains)"


def stages(session: Session) -> tuple[StageErrors, ...]:
    """Errors of the nominal arm, with its geometry, with what was found: what there is, on the same rows."""
    results, words = session.results, stage_words(session)
    if (found := results.identification) is None:
        return ()
    known: list[AbstractValidation | None] = [found.nominal, found.runs[results.fit]]
    if results.accepted:
        known.insert(1, results.geometry or (results.diagnosis and results.diagnosis.before))
    out = []
    for stage, errors in ((s, e) for s, e in zip(STAGES, known, strict=False) if e is not None):
        out.append(StageErrors(stage, words[stage], errors.judged))
    return tuple(out)


def stage_words(session: Session) -> dict[ModelStage, str]:
    """What the model has by each stage, for people; what only predicts is said to be learned."""
    found, words = session.results.diagnosis, {stage: str(stage) for stage in STAGES}
    if found is not None and found.residual_map is not None:
        words[ModelStage.EFFECTS] = f"{'effects and ' if found.causes else ''}learned correction"
    return words


def learned(found: Diagnosis) -> str:
    """How much of the rest a learned correction covers, by squares as the causes are added, in words."""
    sizes = {bar.name: bar.value for bar in budget_bars(found).rows[:-1]}
    if not (size := sizes.pop(LEARNED, 0.0)):
        return ""
    return "most of the rest" if size**2 > sum(each**2 for each in sizes.values()) else "the rest"


def expected_elsewhere(session: Session) -> float:
    """Position error to expect far from the measured poses [mm]; NaN where it is no larger than at them."""
    found = session.results.identification
    if found is None or not found.transfer_warning():
        return float("nan")
    expected = 1e3 * found.best.transfer.anywhere.position
    return expected if expected > stages(session)[-1].error else float("nan")


def shown_stage(session: Session, rows: Comparison) -> ModelStage:
    """The stage whose errors are shown: the last known one up to the chosen one, or to the model as it is."""
    now = ModelStage.EFFECTS if session.results.accepted else ModelStage.GEOMETRY
    up_to = STAGES.index(session.choices.overlay.stage or now)
    return next((s for s in reversed(rows.stages) if STAGES.index(s) <= up_to), ModelStage.NOMINAL)


def before_and_after(session: Session) -> str:
    """Errors of the nominal arm and of the calibrated one as it stands: `Mean error 0.739 → 0.072 mm`."""
    first, *_, last = stages(session)
    return f"Mean error {compared(first.error)} → {compared(last.error)} mm{without_suspects(session)}"


def noise_length(found: Identification) -> float:
    """Mean length of the instrument's position errors [mm]; NaN where its noise is unknown."""
    known = found.instrument
    return 1e3 * NORM_OF_NOISE * known.position if known is not None else float("nan")


def share_of_noise(session: Session, found: Identification) -> float:
    """How many times the instrument's noise is left on average; NaN where that is unknown."""
    left, noise = sure_errors(session, found).position_mm.mean, noise_length(found)
    return left / noise if noise > 0.0 else float("nan")


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

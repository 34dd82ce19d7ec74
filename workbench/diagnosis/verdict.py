"""The verdict of a diagnosis, and its message."""

from collections.abc import Sequence

import numpy as np

from workbench.base.advice import beside
from workbench.base.wording import capital
from workbench.diagnosis.cause_search import CauseSearch
from workbench.diagnosis.claims.cause import Cause, ResidualMap, is_named
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.drivers.driver import OPPOSED, Driver, Shape
from workbench.diagnosis.drivers.evidence import FollowedDriver
from workbench.diagnosis.remaining_error import MAX_NOISE_RATIO, RemainingError
from workbench.diagnosis.result import Verdict
from workbench.diagnosis.saved_model import SavedModel
from workbench.identification.errors.row_errors import explains_little

MAX_STATED_CAUSES = 3
"""Maximum number of causes stated in full."""


@beside("the verdict", (Verdict.UNEXPLAINED, "No verdict."))
def conclude(
    search: CauseSearch,
    saved: SavedModel,
    causes: Sequence[Cause],
    followed: Sequence[FollowedDriver],
    correction: str,
    residual_map: ResidualMap | None,
    remaining: RemainingError,
) -> tuple[Verdict, str]:
    """Verdict and message.

    Args:
        causes: Claimed causes, largest first.
        followed: Drivers that the error follows beside them.
        correction: What a correction by those that the effects leave would reduce, as a sentence.
    """
    if search.too_few is not None:
        return Verdict.UNEXPLAINED, search.too_few
    robot, before, after = search.robot, search.before.judged, search.after.judged
    sure = search.nominal.without(saved.suspects), search.after.without(saved.suspects)
    is_added = residual_map is not None or any(c.is_added for c in causes)
    if explains_little(*sure, robot.reach):
        drivers = "".join(f" The error {f.text}." for f in followed)
        end = "Until this is resolved, the added effects are not meaningful"
        end = end if is_added else "No effects were added"
        little = f"The geometry explains little: {sure[1].text('rms')} of {sure[0].text('rms')} remain"
        text = f"{little}. Check robot, units, frames and sessions. {end}."
        return Verdict.UNEXPLAINED, f"{text}{drivers}{correction}"
    unsure = {j for f in followed for part in f.parts for j in part.joints}
    unsure |= {j for c in causes if c.confidence is Confidence.OPEN for j in c.joints}
    unsure |= set() if residual_map is None else {*residual_map.joints}
    carried = saved.fit.problem.data.payload
    is_told = carried is not None and bool(np.ptp(carried))
    soft = {j for c in causes if c.driver is Driver.LOAD and not is_told for j in c.joints}
    warning = remaining.joint_noise_warning(robot.chain, unsure, soft)
    rest = remaining.text(robot.chain, followed, unsure | soft)
    size = after.text("mean")
    left = f"the remaining error{f' of {size}' if size else ''} {rest}"
    if not causes and residual_map is None and not followed:
        verdict = Verdict.UNEXPLAINED if remaining.is_unexplained else Verdict.NO_EFFECT
        return verdict, f"{warning}No effect was found beside the geometry; {left}."
    fitted, is_known = search.after.train.main.rms, np.isfinite(remaining.noise_ratio)
    is_noise = is_known and after.main.rms <= MAX_NOISE_RATIO * fitted
    is_all = is_noise or is_named(causes, residual_map, before, after)
    is_all = is_all and not remaining.is_unexplained
    verdict = Verdict.EXPLAINED if is_all else Verdict.PARTLY  # a map alone predicts, but explains nothing
    claims = _claims_text(causes, followed, residual_map)
    if not is_added:
        verdict = verdict if causes else Verdict.UNEXPLAINED
        return verdict, f"{warning}{claims}{correction} {capital(left)}."
    if not causes:
        return verdict, f"{warning}{claims}{correction} What remains {rest}."
    pairs = ((before.main, after.main), (before.orientation_deg, after.orientation_deg))
    falls = {new.mean < old.mean for old, new in pairs if old is not None and new is not None}
    fall = f"{'changes' if len(falls) > 1 else 'reduces' if True in falls else 'does not reduce'} the error"
    if np.isfinite(after.main.mean):
        fall += f" from {before.text('mean')} to {after.text('mean')}"
    subject = "Adding it" if len(causes) == 1 and residual_map is None else "Adding the effects"
    return verdict, f"{warning}{claims} {subject} {fall}; what remains {rest}.{correction}"


@beside("the text of the claims", "")
def _claims_text(
    causes: Sequence[Cause], followed: Sequence[FollowedDriver], residual_map: ResidualMap | None
) -> str:
    """Sentences on causes that have a law, on drivers without one, and on the residual map."""
    laws = [c for c in causes if c.is_law]
    sentences = [f"{c.stated}." for c in laws[:MAX_STATED_CAUSES]]
    if len(laws) > MAX_STATED_CAUSES:
        sentences.append(f"{len(laws) - MAX_STATED_CAUSES} more causes are in the table.")
    sentences += doubts(laws)
    sentences += [_driver_text(f) for f in followed]
    if undecided := [c.label for c in causes if c.is_added and not c.is_law]:
        sentences.append(f"Undecided, but added: {'; '.join(undecided)}.")
    if residual_map is not None:
        sentences.append(f"{residual_map.sentence}.")
    return " ".join(sentences)


def _driver_text(followed: FollowedDriver) -> str:
    """A sentence on a driver without a law, and on laws of it that aren't all."""
    kinds = " or ".join(followed.laws)
    law = f"it may be {kinds}: measure where both differ" if followed.either else f"it isn't simply {kinds}"
    law = law if kinds else "no known law of it explains the error"
    if any(part.phrase == OPPOSED for part in followed.parts):
        law = "turn these signs"
    if followed.driver is Driver.COLUMN:
        law = "say what the column is (--columns), or fit its rows by themselves"
    if any(f.shape is Shape.TURNED for f in (*followed.parts, *followed.either)):
        law = "check whether the base is level, as gravity in the robot file says"
    check: dict[Shape | None, str] = {
        Shape.LAG: "give joints and places of the same times, or measure at rest",
        Shape.CARRIED: "check the column 'payload', row by row and its unit, and where it hangs",
        Shape.HANGS: "check where it hangs",
    }
    return f"The error {followed.text}; {check.get(followed.shape, law)}."


def doubts(causes: Sequence[Cause]) -> list[str]:
    """Why causes aren't certain, as sentences: each reason once, with its causes where there are others."""
    whose: dict[str, list[str]] = {}
    for cause in causes:
        whose.setdefault(cause.doubt, []).append(cause.label)
    named = {d: f"Not certain: {'; '.join(labels)}, as {d}." for d, labels in whose.items() if d}
    return list(named.values()) if len(causes) > 1 else [f"{capital(d)}." for d in named]

"""The verdict of a diagnosis, in one sentence."""

from collections.abc import Sequence

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.wording import capital
from workbench.diagnosis.claims.cause import Cause, ResidualMap
from workbench.diagnosis.remaining_error import RemainingError
from workbench.diagnosis.result import Verdict
from workbench.identification.errors.row_errors import Errors
from workbench.identification.result import COARSE, FAR_FROM_GOOD, HARDLY_BETTER

MAX_STATED_CAUSES = 3
"""Maximum number of causes stated in full."""


def conclude(
    causes: Sequence[Cause],
    residual_map: ResidualMap | None,
    remaining: RemainingError,
    *,
    robot: Robot,
    nominal: Errors,
    before: Errors,
    after: Errors,
) -> tuple[Verdict, str]:
    """Verdict and message.

    Args:
        causes: Claimed causes, largest first.
        residual_map: Other added effects, which only predict.
        remaining: The error that is left.
        robot: The nominal arm.
        nominal: Its errors on the judging rows.
        before: Errors of the geometry alone on them.
        after: Errors with the effects.
    """
    is_added = bool(causes or residual_map)
    if explains_little(nominal, after, robot.reach):
        return Verdict.UNEXPLAINED, _lost(is_added, nominal, after)
    opening, rest = remaining.opening(robot.chain), remaining.text(robot.chain)
    if not is_added:
        verdict, size = (
            Verdict.UNEXPLAINED if remaining.is_more_than_noise else Verdict.NONE,
            after.text("mean"),
        )
        of = f" of {size}" if size else ""
        return verdict, f"{opening}No effect was found beside the geometry; the remaining error{of} {rest}."
    verdict = Verdict.PARTLY if remaining.is_more_than_noise else Verdict.EXPLAINED
    added = _added(causes, residual_map)
    if not causes:
        return verdict, f"{opening}{added} What remains {rest}."
    is_no_less = after.position_mm.mean >= before.position_mm.mean
    fall = "does not reduce the error" if is_no_less else "reduces the error"
    if np.isfinite(after.position_mm.mean):
        fall += f" from {before.text('mean')} to {after.text('mean')}"
    subject = "Adding it" if len(causes) == 1 and residual_map is None else "Adding these"
    return verdict, f"{opening}{added} {subject} {fall}; what remains {rest}."


def _added(causes: Sequence[Cause], residual_map: ResidualMap | None) -> str:
    """Sentences on the added effects."""
    sentences = [f"{c.stated}." for c in causes[:MAX_STATED_CAUSES]]
    if len(causes) > MAX_STATED_CAUSES:
        sentences.append(f"{len(causes) - MAX_STATED_CAUSES} more causes are in the table.")
    sentences += doubts(causes)
    if residual_map is not None:
        in_full = residual_map.beside_causes or not causes  # else the decrease is stated for both together
        sentences.append(f"{residual_map.sentence if in_full else residual_map.claim}.")
    return " ".join(sentences)


def doubts(causes: Sequence[Cause]) -> list[str]:
    """Why causes aren't certain, as sentences: each reason once, with its causes where there are others."""
    whose: dict[str, list[str]] = {}
    for cause in causes:
        whose.setdefault(cause.doubt, []).append(cause.label)
    named = {d: f"Not certain: {'; '.join(labels)}, as {d}." for d, labels in whose.items() if d}
    return list(named.values()) if len(causes) > 1 else [f"{capital(d)}." for d in named]


def explains_little(nominal: Errors, found: Errors, reach: float) -> bool:
    """Whether a model explains so little of the nominal arm's errors that effects are meaningless.

    Args:
        nominal: Errors of the nominal arm.
        found: Errors of the model on the same rows.
        reach: Reach of the arm [m].
    """
    before, left = nominal.position_mm.rms, found.position_mm.rms
    return left > max(min(HARDLY_BETTER * before, 1e3 * FAR_FROM_GOOD * reach), COARSE)


def _lost(added: bool, nominal: Errors, after: Errors) -> str:
    """The message if even the geometry explains little."""
    end = "Until this is resolved, the added effects are not meaningful" if added else "No effects were added"
    return (
        f"The geometry explains little: {after.position_mm.rms:.3g} of {nominal.position_mm.rms:.3g} mm "
        f"remain. Check robot, units, frames and sessions. {end}."
    )

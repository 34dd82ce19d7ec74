"""The verdict: what the rows allow to be said, in one sentence."""

from collections.abc import Sequence

from workbench.diagnose.catalogue import Catalogue
from workbench.diagnose.evidence import Offer
from workbench.diagnose.leftover import JointNoise
from workbench.diagnose.record import Accepted, Verdict
from workbench.diagnose.rivals import ambiguous
from workbench.diagnose.words import label
from workbench.identify.problem import Noise
from workbench.identify.result import Fit
from workbench.validate.errors import Errors

NOISE_LIKE = 1.25
"""What is left may be this many times the noise that was known beforehand and still count as noise."""
SPARE = 2.0
"""Measured numbers for each unknown below which effects can hardly be told from the geometry."""


def conclude(
    accepted: Sequence[Accepted],
    *,
    noise: Noise,
    before: Errors,
    after: Errors,
    floor: Noise | None,
    structure: bool,
    distrusted: Sequence[Offer],
    joint_noise: JointNoise | None,
) -> tuple[Verdict, str]:
    """Verdict and message.

    Args:
        accepted: Effects that were added.
        noise: What is left, per axis [m], [rad].
        before: Errors of the geometry alone, on the rows that judge it.
        after: Errors with the effects.
        floor: Noise that was known beforehand.
        structure: Whether neighbouring poses leave alike residuals.
        distrusted: Candidates that chance can't explain, but that cross-validation did not confirm.
        joint_noise: What is left, if it looks like noise of joint readings.
    """
    left = after.position_mm.mean
    more = structure or bool(distrusted)
    rest = f"{left:.3g} mm, is noise"
    if floor is not None:
        ratio = noise.position / floor.position
        more = ratio > NOISE_LIKE
        known = f"the noise known beforehand ({1e3 * floor.position:.2g} mm per axis)"
        rest = (
            f"{left:.3g} mm, agrees with {known}"
            if not more
            else f"{left:.3g} mm, is {ratio:.1f} times {known}"
        )
    elif more:
        rest = f"{left:.3g} mm, still has structure that no effect of the catalogue explains"
    if joint_noise is not None:
        rest += (
            f"; it lies along the joints, as noise of {1e3 * joint_noise.sigma:.2g} mrad in the joint "
            f"readings would ({100 * joint_noise.share:.0f} % of it)"
        )
    if not accepted:
        verdict = Verdict.UNEXPLAINED if more else Verdict.NONE
        return verdict, f"No effect beside the geometry shows; what is left, {rest}."
    verdict = Verdict.PARTLY if more else Verdict.EXPLAINED
    names = " ".join(f"{a.words}." for a in accepted[:3])
    if len(accepted) > 3:
        names += f" {len(accepted) - 3} more effects are listed."
    fall = f"takes the error from {before.position_mm.mean:.3g} to {left:.3g} mm"
    subject = "Adding it" if len(accepted) == 1 else "Adding these"
    return verdict, f"{names} {subject} {fall}; what is left, {rest}.{_doubt(accepted)}"


def _doubt(accepted: Sequence[Accepted]) -> str:
    """A sentence on what the rows can't tell apart."""
    pairs = [(a, r) for a in accepted for r in a.alternatives if r.effect in ambiguous((a,))]
    if not pairs:
        return ""
    words = "; ".join(f"{label(a.effect)} from {label(r.effect)}" for a, r in pairs[:2])
    return f" These rows can't tell {words}."


def too_few(fit: Fit, offered: Catalogue) -> list[str]:
    """A sentence where the rows are too few to tell effects from the geometry, with how many are missing."""
    unknowns = len(fit.problem.names)
    if fit.problem.count >= (1.0 + SPARE) * unknowns:
        return []
    per_row = fit.problem.count / max(len(fit.problem.data), 1)
    missing = int((1.0 + SPARE) * unknowns / per_row) + 1 - len(fit.problem.data)
    return [
        f"{len(fit.problem.data)} rows for {unknowns} unknowns are too few to tell effects from the "
        f"geometry; measure about {missing} more poses, spread over all joints"
    ]

"""The verdict of a diagnosis, in one sentence."""

from collections.abc import Sequence

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import turns
from workbench.arm.effects.effect import STILL
from workbench.arm.robot import Robot
from workbench.base.wording import capital
from workbench.data.dataset import Dataset
from workbench.diagnosis.claims.cause import Cause, ResidualMap
from workbench.diagnosis.claims.structure import Structure
from workbench.diagnosis.result import Verdict
from workbench.diagnosis.search.evidence import Offer
from workbench.identification.errors.row_errors import Errors
from workbench.identification.fit import Fit
from workbench.identification.joint_reading_noise import Readings
from workbench.identification.problem import Noise
from workbench.identification.result import COARSE, FAR_FROM_GOOD, HARDLY_BETTER

SPELT_OUT = 3
"""Maximum number of causes stated in full."""
NOISE_LIKE = 1.25
"""Maximum ratio of the residual to the known noise at which it still counts as noise."""
LEADS = 0.5
"""Share of the remaining error due to joint readings above which the message starts with it."""
LET_SETTLE = "let the arm settle before reading its joints, or average several readings"
"""Advice if all joints scatter."""
CHECK_DRIVES = "check for friction wind-up, a worn coupling or a poor encoder"
"""Advice if only some joints do."""
SMALL_TRAVEL = np.deg2rad(30.0)
"""Range of a joint below which it moved little [rad]; below `STILL` it did not move."""
TOGETHER = 0.02
"""Share of the widest spread of poses below which a direction in joint space was not measured."""
CONTRADICTED = 3.0
"""Standard deviations above which a mass or its centre contradicts the file."""
SPARE = 2.0
"""Minimum measured numbers per unknown to separate effects from geometry."""


def conclude(
    causes: Sequence[Cause],
    residual_map: ResidualMap | None,
    *,
    nominal: Errors,
    reach: float,
    noise: Noise,
    before: Errors,
    after: Errors,
    known_noise: Noise | None,
    structure: Structure,
    distrusted: Sequence[Offer],
    joint_noise: Readings | None,
    chain: Chain,
) -> tuple[Verdict, str]:
    """Verdict and message.

    Args:
        causes: Claimed causes, largest first.
        residual_map: Other added effects, which only predict.
        nominal: Errors of the nominal arm, on the judging rows.
        reach: Reach of the arm [m].
        noise: Standard deviation of the residuals, per axis [m], [rad].
        before: Errors of the geometry alone, on the judging rows.
        after: Errors with the effects.
        known_noise: Noise known beforehand.
        structure: Axes along which neighbouring rows have similar residuals.
        distrusted: Significant candidates that cross-validation did not confirm.
        joint_noise: Noise of joint readings, as far as the rows show any.
    """
    is_added = bool(causes or residual_map)
    if explains_little(nominal, after, reach):
        return Verdict.UNEXPLAINED, _lost(is_added, nominal, after)
    by_readings = joint_noise is not None and joint_noise.joints_that_scatter
    is_structured = any(not (by_readings and axis.is_of_joint) for axis in structure.found)
    of_instrument = noise.position
    if joint_noise is not None and not is_structured:
        of_instrument *= np.sqrt(1.0 - joint_noise.share)
    times_known = np.nan if known_noise is None else of_instrument / known_noise.position
    is_more = bool(is_structured or distrusted) if np.isnan(times_known) else times_known > NOISE_LIKE
    opening, aside = _joint_noise(joint_noise, chain, is_structured)
    remainder = _remainder(structure, is_structured, is_more, times_known, known_noise) + aside
    if not is_added:
        verdict, size = Verdict.UNEXPLAINED if is_more else Verdict.NONE, after.text("mean")
        of = f" of {size}" if size else ""
        return (
            verdict,
            f"{opening}No effect was found beside the geometry; the remaining error{of} {remainder}.",
        )
    verdict, added = Verdict.PARTLY if is_more else Verdict.EXPLAINED, _added(causes, residual_map)
    if not causes:
        return verdict, f"{opening}{added} What remains {remainder}."
    fall = (
        "does not reduce the error"
        if after.position_mm.mean >= before.position_mm.mean
        else "reduces the error"
    )
    if np.isfinite(after.position_mm.mean):
        fall += f" from {before.text('mean')} to {after.text('mean')}"
    subject = "Adding it" if len(causes) == 1 and residual_map is None else "Adding these"
    return verdict, f"{opening}{added} {subject} {fall}; what remains {remainder}."


def _remainder(
    structure: Structure, is_structured: bool, is_more: bool, times_known: float, known_noise: Noise | None
) -> str:
    """Description of the remaining error, continuing a sentence: `agrees with the known noise (0.05 mm per
    axis)`.

    Args:
        is_structured: Whether there is structure apart from joints with scattering readings.
        is_more: Whether it is more than noise.
        times_known: Ratio to the known noise; NaN if none is known.
    """
    if known_noise is not None and np.isfinite(times_known):
        known = f"the known noise ({1e3 * known_noise.position:.2g} mm per axis)"
        agrees = "agrees with" if times_known * NOISE_LIKE > 1.0 else "is less than"
        text = f"is {times_known:.1f} times what {known} explains" if is_more else f"{agrees} {known}"
    elif is_more:
        text = "has structure that no known effect explains"
    elif structure.found:
        text = f"{structure.sentence} in the readings of joints that scatter"
    elif structure.tests:
        text = "shows no structure and is attributed to noise"
    else:
        text = "is attributed to noise: too few rows to test for structure"
    return f"{text}: it {structure.sentence}" if is_structured else text


def _joint_noise(noise: Readings | None, chain: Chain, is_structured: bool) -> tuple[str, str]:
    """Joint-reading noise in the remaining error: an opening sentence if it dominates, else an addition to
    the sentence about the remainder."""
    if noise is None:
        return "", ""
    size, part = noise.text(chain), f"{100 * noise.share:.0f} %"
    if is_structured:
        return "", f"; {part} of it resembles joint-reading noise ({size}) or an effect that was not found"
    if noise.share <= LEADS:
        return "", f"; noise of the joint readings ({size}) accounts for {part} of it"
    advice = CHECK_DRIVES if noise.joints_that_scatter else LET_SETTLE
    if noise.digit:
        advice = f"the file gives them to {noise.digit:g}° only, so record more digits"
    return f"The joint readings scatter by {size}, {part} of the remaining error: {advice}. ", ""


def _added(causes: Sequence[Cause], residual_map: ResidualMap | None) -> str:
    """Sentences on the added effects."""
    sentences = [f"{c.stated}." for c in causes[:SPELT_OUT]]
    if len(causes) > SPELT_OUT:
        sentences.append(f"{len(causes) - SPELT_OUT} more causes are in the table.")
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


def too_few_rows(fit: Fit) -> str | None:
    """A sentence if the rows are too few to separate effects from geometry, and how many are missing."""
    unknowns, data = len(fit.problem.names), fit.problem.data
    if 2 * freedoms(data) < data.joints:
        return (
            f"The {len(data)} poses vary in only {freedoms(data)} of {data.joints} independent directions of "
            "joint space, too few to separate effects from geometry, so no effects were tried; measure poses "
            "spread over all joints."
        )
    if fit.problem.count >= (1.0 + SPARE) * unknowns:
        return None
    per_row = fit.problem.count / max(len(fit.problem.data), 1)
    missing = int((1.0 + SPARE) * unknowns / per_row) + 1 - len(fit.problem.data)
    return (
        f"{len(fit.problem.data)} rows for {unknowns} unknowns are too few to separate effects from "
        f"geometry, so no effects were tried; measure about {missing} more poses, spread over all joints."
    )


def freedoms(data: Dataset) -> int:
    """Number of independent directions in joint space in which the poses vary."""
    span = np.ptp(data.q, axis=0)
    spread = (data.q - data.q.mean(0)) / np.maximum(span, STILL)
    strength = np.linalg.svd(spread, compute_uv=False)
    return int((strength > TOGETHER * strength[0]).sum()) if span.max() > STILL else 0


def coverage(data: Dataset, chain: Chain) -> list[str]:
    """Notes on joints that moved little or only together, and on data with a single group."""
    span = np.ptp(data.q, axis=0)
    little = [j for j in range(data.joints) if turns(chain, j) and STILL < span[j] < SMALL_TRAVEL]
    notes = [
        f"joint {j + 1} moved over only {np.rad2deg(span[j]):.0f}°; its errors outside this range are unknown"
        for j in little
    ]
    if data.group is not None and len(set(data.group.tolist())) == 1:
        notes.append("all fitted rows belong to one group, so effects were cross-validated row by row")
    together = freedoms(data)
    if together < int((span > STILL).sum()):
        notes.append(
            f"the joints moved together, in {together} instead of {data.joints} independent directions: the "
            "result is valid for such poses, and effects of different joints can hardly be separated"
        )
    return notes


def weights_that_differ(fit: Fit, given: Robot) -> list[str]:
    """Notes on masses missing in the file, and on masses and centres in it that contradict the rows."""
    known, out = fit.problem.robot.inertia_tolerance, []
    found, errors = fit.problem.named(fit.x), fit.problem.named(fit.std)
    for old, new in zip(given.joints, fit.problem.robot.joints, strict=True):
        if old.mass is None and new.mass is not None:
            name = f"{new.name}.mass"
            value = f"{found[name]:.3g} ± {errors[name]:.2g} kg fitted" if name in found else "not observable"
            out.append(
                f"the file lacks the mass of the link after {new.name}: {new.mass:.3g} kg assumed, {value}"
            )
            known = {n: s for n, s in known.items() if not n.startswith(f"{new.name}.")}
    for p, value, error in zip(fit.parameters, fit.x.tolist(), fit.std.tolist(), strict=True):
        if p.name in known and abs(value - p.nominal) > CONTRADICTED * known[p.name]:
            link, part = p.name.split(".")
            what = "mass" if part == "mass" else f"centre of mass ({part[-1]})"
            factor, unit = (1.0, "kg") if part == "mass" else (1e3, "mm")
            out.append(
                f"the {what} of the link after {link} contradicts the file: {factor * p.nominal:.3g} {unit} "
                f"there, {factor * value:.3g} ± {factor * error:.2g} {unit} measured"
            )
    return out

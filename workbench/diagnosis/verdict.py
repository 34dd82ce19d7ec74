"""The verdict of a diagnosis, in one sentence."""

from collections.abc import Sequence

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import turns
from workbench.arm.effects.effect import STILL
from workbench.arm.robot import Robot
from workbench.base.wording import capital
from workbench.data.dataset import Dataset
from workbench.diagnosis.claimed_causes import Cause, ResidualMap
from workbench.diagnosis.evidence import Offer
from workbench.diagnosis.result import Verdict
from workbench.diagnosis.structure import Structure
from workbench.identification.fit import Fit
from workbench.identification.joint_reading_noise import Readings
from workbench.identification.problem import Noise
from workbench.identification.result import COARSE, FAR_FROM_GOOD, HARDLY_BETTER
from workbench.identification.row_errors import Errors

SPELT_OUT = 3
"""Maximum number of causes stated in full."""
NOISE_LIKE = 1.25
"""What is left may be this many times the noise that was known beforehand and still count as noise."""
LEADS = 0.5
"""Share of the remaining error due to joint readings above which the message opens with it."""
SETTLE = "let the arm settle before its joints are read, or average several readings"
"""Advice if all joints scatter."""
LOOK = "check for friction that winds up the drive, a worn coupling or a poor encoder"
"""Advice if only some joints do."""
LITTLE = np.deg2rad(30.0)
"""A joint that turned less than this moved little [rad]; below `STILL` it did not move."""
TOGETHER = 0.02
"""Part of the widest spread of poses below which a direction in joint space was not measured."""
CONTRADICTED = 3.0
"""Standard deviations by which a mass or its centre may differ from the file."""
SPARE = 2.0
"""Measured numbers for each unknown below which effects can hardly be told from the geometry."""


def conclude(
    causes: Sequence[Cause],
    residual_map: ResidualMap | None,
    *,
    nominal: Errors,
    reach: float,
    noise: Noise,
    before: Errors,
    after: Errors,
    floor: Noise | None,
    structure: Structure,
    distrusted: Sequence[Offer],
    joint_noise: Readings | None,
    chain: Chain,
) -> tuple[Verdict, str]:
    """Verdict and message.

    Args:
        causes: What is claimed, the largest first.
        residual_map: What else was added, and predicts alone.
        nominal: Errors of the nominal arm, on the rows that judge it.
        reach: Reach of the arm [m].
        noise: Standard deviation of what is left, per axis [m], [rad].
        before: Errors of the geometry alone, on the rows that judge it.
        after: Errors with the effects.
        floor: Noise that was known beforehand.
        structure: Axes along which neighbouring rows have similar residuals.
        distrusted: Candidates that chance can't explain, but that cross-validation did not confirm.
        joint_noise: Noise of joint readings, as far as the rows show any.
    """
    left = after.position_mm.mean
    if explains_little(nominal, after, reach):
        return Verdict.UNEXPLAINED, _lost(bool(causes or residual_map), nominal, after)
    alone = joint_noise is not None and bool(joint_noise.alone)
    is_structured = bool(structure.found) and not (alone and all(a.is_of_joint for a in structure.found))
    more = bool(is_structured or distrusted)
    rest = "is taken to be noise: too few rows to look for structure"
    if structure.tests:
        rest = "shows no structure, so it is taken to be noise"
    if structure.found:
        rest = f"{structure.sentence} in the readings of joints that scatter"
    if floor is not None and np.isfinite(noise.position):
        instrument = 1.0 if joint_noise is None or is_structured else 1.0 - joint_noise.share
        ratio = np.sqrt(instrument) * noise.position / floor.position
        more = ratio > NOISE_LIKE
        known = f"the known noise ({1e3 * floor.position:.2g} mm per axis)"
        agrees = "agrees with" if ratio * NOISE_LIKE > 1.0 else "is less than"
        rest = f"is {ratio:.1f} times what {known} explains" if more else f"{agrees} {known}"
    elif more:
        rest = "has structure that no known effect explains"
    if is_structured:
        rest += f": it {structure.sentence}"
    lead = ""
    if joint_noise is not None:
        size, part = joint_noise.text(chain), f"{100 * joint_noise.share:.0f} %"
        if is_structured:
            rest += f"; {part} of it is like noise of the joint readings ({size}), or an effect not found yet"
        elif joint_noise.share > LEADS:
            advice = LOOK if joint_noise.alone else SETTLE
            lead = f"The joint readings scatter by {size}, which makes {part} of what is left: {advice}. "
        else:
            rest += f"; noise of the joint readings ({size}) makes {part} of it"
    if not (causes or residual_map):
        verdict, size = Verdict.UNEXPLAINED if more else Verdict.NONE, after.text("mean")
        of = f" of {size}" if size else ""
        return verdict, f"{lead}No effect was found beside the geometry; the remaining error{of} {rest}."
    verdict = Verdict.PARTLY if more else Verdict.EXPLAINED
    sentences = [f"{c.stated}." for c in causes[:SPELT_OUT]]
    if len(causes) > SPELT_OUT:
        sentences.append(f"{len(causes) - SPELT_OUT} more causes are listed.")
    sentences += doubts(causes)
    if residual_map is not None:
        in_full = residual_map.beside_causes or not causes  # else the fall of both together says it all
        sentences.append(f"{residual_map.sentence if in_full else residual_map.claim}.")
    if not causes:
        return verdict, f"{lead}{' '.join(sentences)} What remains {rest}."
    fall = "reduces the error"
    if np.isfinite(left):
        fall += f" from {before.text('mean')} to {after.text('mean')}"
    subject = "Adding it" if len(causes) == 1 and residual_map is None else "Adding these"
    return verdict, f"{lead}{' '.join(sentences)} {subject} {fall}; what remains {rest}."


def doubts(causes: Sequence[Cause]) -> list[str]:
    """Why causes can't be certain, each reason once, as sentences."""
    return [f"{capital(doubt)}." for doubt in dict.fromkeys(c.doubt for c in causes if c.doubt)]


def explains_little(nominal: Errors, found: Errors, reach: float) -> bool:
    """Whether a model explains so little of the nominal arm's errors that nothing can be said of effects.

    Args:
        nominal: Errors of the nominal arm.
        found: Errors of the model, on the same rows.
        reach: Of the arm [m].
    """
    before, left = nominal.position_mm.rms, found.position_mm.rms
    return left > max(min(HARDLY_BETTER * before, 1e3 * FAR_FROM_GOOD * reach), COARSE)


def _lost(added: bool, nominal: Errors, after: Errors) -> str:
    """The message if not even the geometry explains much."""
    end = "Until this is resolved, the added effects mean little" if added else "No effects were added"
    return (
        f"The geometry explains little: {after.position_mm.rms:.3g} of {nominal.position_mm.rms:.3g} mm "
        f"remain. Check the robot, the units, the frames and the sessions. {end}."
    )


def too_few_rows(fit: Fit) -> str | None:
    """A sentence where the rows are too few to tell effects from the geometry, with how many are missing."""
    unknowns, data = len(fit.problem.names), fit.problem.data
    if 2 * freedoms(data) < data.joints:
        return (
            f"The {len(data)} poses vary in only {freedoms(data)} of {data.joints} independent directions of "
            "joint space, too few to tell effects from the geometry, so none were looked for; measure poses "
            "spread over all joints."
        )
    if fit.problem.count >= (1.0 + SPARE) * unknowns:
        return None
    per_row = fit.problem.count / max(len(fit.problem.data), 1)
    missing = int((1.0 + SPARE) * unknowns / per_row) + 1 - len(fit.problem.data)
    return (
        f"{len(fit.problem.data)} rows for {unknowns} unknowns are too few to tell effects from the "
        f"geometry, so none were looked for; measure about {missing} more poses, spread over all joints."
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
    little = [j for j in range(data.joints) if turns(chain, j) and STILL < span[j] < LITTLE]
    notes = [
        f"joint {j + 1} moved over only {np.rad2deg(span[j]):.0f}°; outside this range nothing is known of it"
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


def weights_that_differ(fit: Fit, file: Robot) -> list[str]:
    """Sentences on masses that the file lacks, and on masses and centres in it that the rows contradict."""
    known, out = fit.problem.robot.inertia_tolerance, []
    found, errors = fit.problem.named(fit.x), fit.problem.named(fit.std)
    for old, new in zip(file.joints, fit.problem.robot.joints, strict=True):
        if old.mass is None and new.mass is not None:
            name = f"{new.name}.mass"
            value = (
                f"{found[name]:.3g} ± {errors[name]:.2g} kg fitted" if name in found else "no load shows it"
            )
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
                f"the file's {what} of the link after {link} doesn't fit: it says {factor * p.nominal:.3g} "
                f"{unit}, the measurements {factor * value:.3g} ± {factor * error:.2g} {unit}"
            )
    return out

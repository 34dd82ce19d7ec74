"""Notes of a diagnosis beside its verdict."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Int

from workbench.arm.effects import extrapolation_notes
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.diagnosis.cause_search import CauseSearch
from workbench.diagnosis.coverage import coverage
from workbench.diagnosis.gravity_direction import standing_notes
from workbench.diagnosis.saved_model import SavedModel
from workbench.diagnosis.undetectable import describe
from workbench.identification.checks.instrument_scale import instrument_scale
from workbench.identification.fit import Fit
from workbench.identification.rows.excluded_outliers import suspect_note
from workbench.identification.rows.two_places import two_places

NO_DIRECTION = (
    "backlash that depends on the direction of motion was not tried: rows have neither times nor directions; "
    "add time[s] if they are in the order of measurement, or else direction1 …"
)

NO_PAYLOAD = (
    "no row has a payload: what gives way is sized as if the arm carried no more than its own links, and too "
    "large if there is a heavy tool; if so, add payload[kg]"
)
MASSES = "what gives way is sized by the masses in the file; its ± holds if these are right to about {:.0%}"

MAX_MASS_DEVIATION = 3.0
"""Standard deviations above which a mass or its centre contradicts the file."""


@beside("notes", ())
def notes(
    search: CauseSearch, saved: SavedModel, outliers: Int[np.ndarray, " k"], given: Robot
) -> Iterator[str]:
    """Notes for the user beside the verdict, one sentence each."""
    ready, last = search.ready, search.last
    fit, effects, chain = last.stage.fit, [a.effect for a in saved.effects], search.robot.chain
    yield from ready.notes
    alone = search.first.fit if last.model else search.judged_fit
    if any(alone.problem.noise.joints) and not any(ready.problem.noise.joints):
        yield "geometry: weighed by the scatter of joints that it leaves; 'identify' weighs all rows alike"
    yield from last.offered.notes
    yield from [] if search.too_few else coverage(fit.problem.data, chain)
    yield from (
        f"held out: {text}"
        for text in extrapolation_notes(effects, chain, ready.held_out_data.q, ready.held_out_data.row)
    )
    if saved.suspects.any():
        yield suspect_note(ready.held_out_data.row[saved.suspects].tolist(), search.after.judged)
    yield from [saved.note] if saved.note is not None else []
    if search.too_few is None and saved.undetectable and any(e.loads for e in effects):
        yield describe(saved.undetectable)
    rows = ready.data.take(np.union1d(ready.train_rows, outliers))
    if not effects and (two := two_places(search.first.fit, rows)):  # an effect may be what parts them
        yield two
    if scale := instrument_scale(ready.aligned, fit.problem.data):
        yield scale
    yield from _weights_that_differ(saved.fit, given)
    yield from standing_notes(saved.fit, given)
    motion = last.stage.motion
    if given.has_masses and any(e.loads for e in effects):
        yield MASSES.format(max(j.mass_tolerance for j in given.joints))
        yield from [NO_PAYLOAD] if motion.payload is None else []
    if motion.direction is None:
        yield NO_DIRECTION


@beside("notes on masses", ())
def _weights_that_differ(fit: Fit, given: Robot) -> list[str]:
    """Notes on masses missing in the file, and on masses and centres in it that contradict the rows."""
    known, out = fit.problem.robot.inertia_tolerance, []
    found, errors = fit.problem.named(fit.x), fit.problem.named(fit.std)
    for old, new in zip(given.joints, fit.problem.robot.joints, strict=True):
        if old.mass is None and new.mass is not None:
            name = f"{new.name}.mass"
            value = f"{found[name]:.3g} ± {errors[name]:.2g} kg fitted" if name in found else "not observable"
            lacks = f"the file lacks the mass of the link after {new.name}"
            out.append(f"{lacks}: {new.mass:.3g} kg assumed, {value}")
            known = {n: s for n, s in known.items() if not n.startswith(f"{new.name}.")}
    for p, value, error in zip(fit.parameters, fit.x.tolist(), fit.std.tolist(), strict=True):
        if p.name in known and abs(value - p.nominal) > MAX_MASS_DEVIATION * known[p.name]:
            link, part = p.name.split(".")
            what = "mass" if part == "mass" else f"centre of mass ({part[-1]})"
            factor, unit = (1.0, "kg") if part == "mass" else (1e3, "mm")
            out.append(
                f"the {what} of the link after {link} contradicts the file: {factor * p.nominal:.3g} {unit} "
                f"there, {factor * value:.3g} ± {factor * error:.2g} {unit} measured"
            )
    return out

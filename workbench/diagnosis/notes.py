"""Notes of a diagnosis beside its verdict."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Int

from workbench.arm.effects import extrapolation_notes
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.diagnosis.cause_search import CauseSearch
from workbench.diagnosis.coverage import coverage
from workbench.diagnosis.gravity_tilt import standing_notes
from workbench.diagnosis.saved_model import SavedModel
from workbench.identification.checks.common_errors import instrument_scale, two_kinds, worse_by_column
from workbench.identification.preparation import UNKNOWN_NOISE
from workbench.identification.rows.excluded_outliers import suspect_note

NO_DIRECTION = (
    "backlash that depends on the direction of motion was not tried: rows have neither directions nor times "
    "that differ; add time[s] if they are in the order of measurement, or else direction1 …"
)
NO_PAYLOAD = (
    "no row has a payload: what gives way is sized as if the arm carried no more than its own links, and too "
    "large if there is a heavy tool; if so, add payload[kg]"
)
MASSES = "what gives way is sized by the masses in the file; its ± holds if these are right to about {:.0%}"


@beside("notes", ())
def notes(
    search: CauseSearch, saved: SavedModel, outliers: Int[np.ndarray, " k"], given: Robot
) -> Iterator[str]:
    """Notes for the user beside the verdict, one sentence each."""
    ready, last = search.ready, search.last
    fit, effects, chain = last.stage.fit, [a.effect for a in saved.effects], search.robot.chain
    # what the geometry left before outliers were found is not what is left
    yield from (UNKNOWN_NOISE if len(outliers) and n.startswith(UNKNOWN_NOISE) else n for n in ready.notes)
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
    rows = ready.data.take(np.union1d(ready.train_rows, np.r_[outliers, ready.held_out_rows]))
    yield "" if effects else two_kinds(search.first.fit, rows)  # an effect may be what parts them
    yield worse_by_column(search.first.fit, rows, rows.unread)
    yield instrument_scale(ready.aligned, fit.problem.data)
    yield from standing_notes(saved.fit, given)
    motion = last.stage.motion
    for old, new in zip(given.joints, search.robot.joints, strict=True):
        if old.mass is None and new.mass is not None:
            yield f"the file lacks the mass of the link after {new.name}: {new.mass:.3g} kg assumed"
    if given.has_masses and any(e.loads for e in effects):
        yield MASSES.format(max(j.mass_tolerance for j in given.joints))
        yield from [NO_PAYLOAD] if motion.payload is None else []
    if motion.direction is None:
        yield NO_DIRECTION

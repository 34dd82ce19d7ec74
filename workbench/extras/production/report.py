"""The yield of a plate, for people and programs."""

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from workbench.extras.production.production_yield import Yield
from workbench.report.json import Json, document
from workbench.report.tables import new_table

YIELD = "workbench.plate-yield/1"


def yield_tables(found: Yield) -> RenderableType:
    """The share of good arms, errors, what is to blame, and how well the prediction held."""
    low, high = found.interval
    arms = new_table(f"{found.arms} virtual arms, {found.wanted.text}", "", "")
    arms.add_row("arms that meet it", f"{100 * found.share:.2f} %")
    arms.add_row("95 % confidence", f"{100 * low:.2f} … {100 * high:.2f} %")
    arms.add_row("arms that could not reach every target", str(int((~found.reached).sum())))
    arms.add_row("arms that needed another branch", str(int((found.reached & ~found.planned).sum())))
    worst = np.percentile(found.position, [50, 95, 100])
    arms.add_row(escape("position error, rms [mm]"), f"{1e3 * found.position_rms:.3f}")
    arms.add_row(escape("median, 95 %, worst arm [mm]"), " / ".join(f"{1e3 * value:.3f}" for value in worst))
    arms.add_row("orientation error, rms [°]", f"{np.rad2deg(found.rotation_rms):.3f}")
    sources = new_table("Each source alone", "", "position [mm]", "orientation [°]", "share [%]")
    for name, share in sorted(found.shares.items(), key=lambda item: -item[1]):
        position, rotation = found.sources[name]
        sources.add_row(name, f"{1e3 * position:.4f}", f"{np.rad2deg(rotation):.4f}", f"{100 * share:.1f}")
    return Group(arms, sources, Text("\n".join(_yield_notes(found))))


def _yield_notes(found: Yield) -> list[str]:
    notes = [f"errors include: {found.assumptions}"] if found.assumptions else []
    if found.blame is not None:
        notes.append(f"the {found.blame} dominates")
    if len(found.cells):
        position = found.agreement[:, 0]
        notes.append(
            f"observed by predicted position error in {len(found.cells)} cubes: {position.min():.2f} … "
            f"{position.max():.2f}"
        )
    if not found.outcome.ok:
        notes.append(f"the trial was {found.outcome}; these are the arms so far")
    return [*notes, *found.notes]


def yield_sentence(found: Yield) -> str:
    """Share of the arms that meet the requirement, its interval, arms short of targets, main error."""
    low, high = (100 * bound for bound in found.interval)
    text = (
        f"{100 * found.share:.1f} % of {found.arms} virtual arms meet {found.wanted.text} everywhere "
        f"in the region (95 % confidence {low:.1f} … {high:.1f} %)"
    )
    if lacking := int((~found.reached).sum()):
        text += f"; {lacking} of them are calibrated with the targets that they reach, not with all"
    return text if found.blame is None else f"{text}; the {found.blame} dominates"


def yield_json(found: Yield) -> Json:
    """The yield with the distribution over the cubes of the region."""
    cubes = zip(found.cells, found.samples, found.predicted, found.observed, strict=True)
    return document(
        YIELD,
        outcome=found.outcome,
        arms=found.arms,
        holds=found.assumptions,
        requirement=found.wanted.json(),
        share=found.share,
        share_95=found.interval,
        not_reached=(~found.reached).sum(),
        other_branch=(found.reached & ~found.planned).sum(),
        position_rms_mm=1e3 * found.position_rms,
        orientation_rms_deg=np.rad2deg(found.rotation_rms),
        sources={
            name: {
                "position_rms_mm": 1e3 * position,
                "orientation_rms_deg": np.rad2deg(rotation),
                "share": found.shares.get(name, 0.0),
            }
            for name, (position, rotation) in found.sources.items()
        },
        cubes=[
            {
                "cube": cell,
                "samples": samples,
                "position_mm": {"predicted": 1e3 * p[0], "observed": 1e3 * o[0]},
                "orientation_deg": {"predicted": np.rad2deg(p[1]), "observed": np.rad2deg(o[1])},
            }
            for cell, samples, p, o in cubes
        ],
        notes=found.notes,
    )

"""Designed plates, for people and programs."""

from collections.abc import Iterator
from itertools import zip_longest
from typing import Any

import numpy as np

from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import places_of
from workbench.report.blocks import Block, ResultTable, Sentence
from workbench.report.json import Json, document
from workbench.report.result_display import blocks_of
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields

DESIGN = "workbench.plate-design/1"
PREDICTED = ResultFields(
    ResultField("position_rms", MM, of="cost"),
    ResultField("orientation_rms", DEG, of="rotation"),
    ResultField("given_position_rms", MM, of="start_cost"),
)
TARGET = ResultFields("xyz", "rpy", "branch", "q")


@blocks_of.register
def design_blocks(design: PlateDesign) -> Iterator[Block]:
    """The design target by target, then its predicted errors."""
    places = places_of(design.plate.pose, design.plate.poses)
    margins = design.clearance, design.limit_margin
    each: Any = zip_longest(design.plate.targets, places, *margins, fillvalue=np.nan)
    rows = [
        (
            f"{i}: {target.branch}",
            ", ".join(f"{1e3 * value:z.0f}" for value in place[:3]),
            ", ".join(f"{np.rad2deg(value):z.0f}" for value in place[3:]),
            f"{1e3 * clear:.1f}".replace("nan", "–"),
            f"{np.rad2deg(margin):.0f}".replace("nan", "–"),
        )
        for i, (target, place, clear, margin) in enumerate(each, start=1)
    ]
    headings = ("target, branch", "place [mm]", "angles [°]", "clear [mm]", "limits [°]")
    yield ResultTable(design.plate.name, headings, rows)
    yield Sentence(
        "place: x, y on the plate, height; angles: tilt, azimuth, spin; clear: clearance; limits: margins"
    )
    placed = f"{1e3 * design.cost:.3f} mm" if np.isfinite(design.cost) else "position undetermined"
    known = np.isfinite(design.rotation)
    turned = f"{np.rad2deg(design.rotation):.3f}°" if known else "orientation undetermined"
    where = "in the region, near the given plate's orientations"
    yield Sentence(f"predicted rms error {where}: {placed}, {turned}")
    yield Sentence(f"included: {design.assumptions}")
    if np.isfinite(design.start_cost):
        given = f"{1e3 * design.start_cost:.3f} mm, {design.gain:.2f} times as large"
        yield Sentence(f"the given plate, made alike, in its best branches without collision check: {given}")
    if not design.outcome.ok:
        yield Sentence(f"the search was {design.outcome}; this is the best so far")
    yield from map(Sentence, design.notes)


def design_json(design: PlateDesign) -> Json:
    margins = design.clearance, design.limit_margin
    each: Any = zip_longest(design.plate.targets, *margins, fillvalue=np.nan)
    return document(
        DESIGN,
        plate=design.plate.name,
        outcome=design.outcome,
        holds=design.assumptions,
        predicted=PREDICTED.json(design),
        spacing_mm=1e3 * design.spacing,
        targets=[
            TARGET.json(target) | {"clearance_mm": MM.of(clear), "limit_margin_deg": DEG.of(margin)}
            for target, clear, margin in each
        ],
        notes=design.notes,
    )

"""Designed plates, for people and programs."""

from collections.abc import Iterator
from operator import itemgetter

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
MARGINS = ResultFields(
    ResultField("clearance", MM, of=itemgetter(0)), ResultField("limit_margin", DEG, of=itemgetter(1))
)
"""Of a target's clearance [m] and distance from the joint limits [rad]; None where unchecked."""


@blocks_of.register
def design_blocks(design: PlateDesign) -> Iterator[Block]:
    """The design target by target, then its predicted errors."""
    places = places_of(design.plate.pose, design.plate.poses)
    rows = [
        (
            f"{i + 1}: {target.branch}",
            ", ".join(f"{1e3 * value:z.0f}" for value in place[:3]),
            ", ".join(f"{np.rad2deg(value):z.0f}" for value in place[3:]),
            f"{1e3 * design.clearance[i]:.1f}" if len(design.clearance) > i else "–",
            f"{np.rad2deg(design.limit_margin[i]):.0f}" if len(design.clearance) > i else "–",
        )
        for i, (target, place) in enumerate(zip(design.plate.targets, places, strict=True))
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
    checked = [*zip(design.clearance, design.limit_margin, strict=True)] or [(None, None)] * len(design.plate)
    return document(
        DESIGN,
        plate=design.plate.name,
        outcome=design.outcome,
        holds=design.assumptions,
        predicted=PREDICTED.json(design),
        spacing_mm=1e3 * design.spacing,
        targets=[
            TARGET.json(target) | MARGINS.json(margins)
            for target, margins in zip(design.plate.targets, checked, strict=True)
        ],
        notes=design.notes,
    )

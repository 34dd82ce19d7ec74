"""Designed plates, for people and programs."""

from collections.abc import Iterator
from operator import itemgetter

import numpy as np

from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import places_of
from workbench.plate.plate import Kind
from workbench.report.blocks import Block, ResultTable, Sentence
from workbench.report.chart import Chart, Marks
from workbench.report.colours import CALIBRATED
from workbench.report.json import Json, document
from workbench.report.result_display import blocks_of
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields

DESIGN = "workbench.plate-design/1"
PREDICTED = ResultFields(
    ResultField("position_rms", MM, of="cost"),
    ResultField("orientation_rms", DEG, of="rotation"),
    ResultField("given_position_rms", MM, of="start_cost"),
    ResultField("given_keeps_constraints", of="start_kept"),
)
TARGET = ResultFields("xyz", "rpy", "branch", "q")
MARGINS = ResultFields(
    ResultField("clearance", MM, of=itemgetter(0)), ResultField("limit_margin", DEG, of=itemgetter(1))
)
"""Of a target's clearance [m] and distance from the joint limits [rad]; None where unchecked."""


@blocks_of.register
def design_blocks(design: PlateDesign) -> Iterator[Block]:
    """The design target by target, how the search went, then its predicted errors."""
    places = places_of(design.plate, design.plate.poses)
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
    errors = 1e3 * np.array(design.history)
    line, last = Marks(np.arange(len(errors), dtype=float), errors, CALIBRATED, is_line=True), len(errors) - 1
    title = "Predicted position error after every round of the search, rms [mm]"
    yield Chart([line], ticks=[(0.0, "start"), (float(last), str(last))], floor=0.0, title=title)
    yield Sentence(
        "place: x, y on the plate, height; angles: tilt, azimuth, spin; clear: clearance; limits: margins"
    )
    known = np.isfinite(design.rotation)
    turned = f"{np.rad2deg(design.rotation):.3f}°" if known else "orientation undetermined"
    where = "in the region, near the given plate's orientations"
    yield Sentence(f"predicted rms error {where}: {1e3 * design.cost:.3f} mm, {turned}")
    yield Sentence(f"included: {design.assumptions}")
    shapes, blocks = design.plate_shapes, len(design.plate)
    if any(target.kind is not Kind.POINT for target in design.plate.targets):
        cheaper = "; --shapes 3 or --angles 0deg,30deg make them cheaper"
        more = cheaper if shapes > max(3, blocks // 3) else ""
        yield Sentence(f"{shapes} different blocks for {blocks} targets{more}")
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
        shapes=design.plate_shapes,
        spacing_mm=1e3 * design.spacing,
        targets=[
            TARGET.json(target) | MARGINS.json(margins)
            for target, margins in zip(design.plate.targets, checked, strict=True)
        ],
        history_mm=1e3 * np.array(design.history),
        notes=design.notes,
    )

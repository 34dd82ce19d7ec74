"""Designed plates, for people and programs."""

from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import places_of
from workbench.plate.plate import Kind
from workbench.report.json import Json, document
from workbench.report.result_display import plot_of, summary_of
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields
from workbench.report.tables import new_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


@summary_of.register
def design_tables(design: PlateDesign) -> RenderableType:
    """The design target by target, then its predicted errors."""
    table = new_table(
        design.plate.name, *("target, branch", "place [mm]", "angles [°]", "clear [mm]", "limits [°]")
    )
    places = places_of(design.plate, design.plate.poses)
    for i, (target, place) in enumerate(zip(design.plate.targets, places, strict=True)):
        known = len(design.clearance) > i
        table.add_row(
            f"{i + 1}: {escape(target.branch)}",
            ", ".join(f"{1e3 * value:z.0f}" for value in place[:3]),
            ", ".join(f"{np.rad2deg(value):z.0f}" for value in place[3:]),
            f"{1e3 * design.clearance[i]:.1f}" if known else "–",
            f"{np.rad2deg(design.limit_margin[i]):.0f}" if known else "–",
        )
    return Group(table, Text("\n".join(_design_text(design))))


def _design_text(design: PlateDesign) -> list[str]:
    turned = (
        f"{np.rad2deg(design.rotation):.3f}°" if np.isfinite(design.rotation) else "orientation undetermined"
    )
    error = f"{1e3 * design.cost:.3f} mm, {turned}"
    sentences = [
        "place: x, y on the plate, height; angles: tilt, azimuth, spin; clear: clearance; limits: margins",
        f"predicted rms error in the region, near the given plate's orientations: {error}",
        f"included: {design.assumptions}",
    ]
    shapes, blocks = design.plate_shapes, len(design.plate)
    if any(target.kind is not Kind.POINT for target in design.plate.targets):
        sentences.append(f"{shapes} different blocks for {blocks} targets")
        if shapes > max(3, blocks // 3):
            sentences[-1] += "; --shapes 3 or --angles 0deg,30deg make them cheaper"
    if np.isfinite(design.start_cost):
        given = f"{1e3 * design.start_cost:.3f} mm, {design.gain:.2f} times as large"
        sentences.append(
            f"the given plate, made alike, in its best branches without collision check: {given}"
        )
    if not design.outcome.ok:
        sentences.append(f"the search was {design.outcome}; this is the best so far")
    return [*sentences, *design.notes]


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


@plot_of.register(PlateDesign)
def _figure(design: PlateDesign) -> "Figure":
    from workbench.plate.report.figures import design_figure

    return design_figure(design)

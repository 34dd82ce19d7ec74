"""The page of a plate: seen from above, ordinates from its lower left corner, a table of all holes.

Its datums are its top (A) and its lower and left edges (B, C).
"""

import numpy as np

from workbench.plate.parts.drawing import (
    PAPERS,
    TEXT,
    Circle,
    Item,
    Layer,
    Line,
    Page,
    View,
    Words,
    paper_for,
)
from workbench.plate.parts.page_parts import (
    BORDER,
    BOTTOM,
    LINE,
    MM,
    SHORT,
    TITLE,
    lines,
    spread,
    table,
    title,
)
from workbench.plate.parts.parts import Fixture, Slab
from workbench.plate.parts.tolerances import GENERAL


def slab_page(fixture: Fixture, slab: Slab) -> Page:
    """Seen from above, origin at the lower left corner."""
    length, width, thickness = (MM * slab.size).tolist()
    own = slab is fixture.slab
    paper, scale = paper_for(length, width, (175.0, 80.0))
    _, top = PAPERS[paper]
    view = View(np.array([BORDER + 50.0, top - BORDER - 40.0 - width / scale]), scale)
    items: list[Item] = [view.line([(0, 0), (length, 0), (length, width), (0, width)])]
    places = [MM * (bore.mouth[:2] + 0.5 * slab.size[:2]) for bore in slab.bores]
    for place, bore in zip(places, slab.bores, strict=True):
        items += view.hole(place, MM * bore.diameter)
        if not bore.label.isdecimal():
            items.append(view.label(place, MM * bore.diameter, bore.label))
    if own:
        items += _feet(fixture, view)
    across = view.across((0, 0), (length, 0), (0.0, -10.0), 0.0)
    up = view.across((length, 0), (length, width), (length / scale + 16.0, 0.0), 90.0)
    items += [across, up, *_ordinates(np.array(_named(fixture, slab, places)), view, width)]
    left = view.origin[0] + length / scale + 34.0
    rows = [("hole", "x", "y", "size", "for")] + [
        (bore.label, f"{x:z.3f}", f"{y:z.3f}", bore.size, SHORT[bore.purpose])
        for (x, y), bore in zip(places, slab.bores, strict=True)
    ]
    room = int((top - BORDER - TITLE[1] - 50.0) / LINE)
    if len(rows) > room:
        rows = [*rows[: room - 1], ("…", "", "", "", f"{len(rows) - room} more in holes.csv")]
    items += table(rows, np.array([left, top - BORDER - 4.0]), (14, 24, 24, 26, 36))
    name = "plate" if own else "bottom plate"
    notes = (
        _plate_notes(fixture)
        if own
        else [
            "Robot's foot: centre of the circle R, x as the plate's drawing.",
            "All holes: position Ø0.2 to the lower and the left edge.",
        ]
    )
    items += lines(notes, np.array([left, top - BORDER - 10.0 - LINE * len(rows)]))
    items += title(
        paper,
        (
            f"{fixture.name}: {name}",
            f"{length:.1f} × {width:.1f} × {thickness:.1f}, quantity {slab.quantity}; all holes through",
            f"{fixture.stock.sheet if own else BOTTOM}; scale 1:{scale:g}, mm; seen from above",
            f"general tolerances {GENERAL}; surfaces Ra 3.2, top Ra 1.6; edges broken 0.3",
            f"file {slab.name}.step / .stl / .dxf",
        ),
    )
    return Page(name=slab.name, paper=paper, scale=scale, items=tuple(items))


def _named(fixture: Fixture, slab: Slab, places: list[np.ndarray]) -> list[np.ndarray]:
    """Points with ordinates: the blocks' feet, or every hole."""
    if slab is not fixture.slab:
        return places
    return [np.array(fixture.from_corner(block.pose[:3, 3])) for block in fixture.blocks]


def _feet(fixture: Fixture, view: View) -> list[Item]:
    """Outlines of the blocks with number and shape, a tick where faces slope down, and the robot's base."""
    items: list[Item] = []
    for block in fixture.blocks:
        foot = MM * (block.footprint + 0.5 * fixture.slab.size[:2])
        items.append(view.line(foot, Layer.BLOCKS))
        edge, middle = foot[1:3].mean(axis=0), foot.mean(axis=0)
        out = (edge - middle) / np.linalg.norm(edge - middle)
        items.append(Line(np.array([view.at(edge), view.at(edge) + 4.0 * out]), Layer.OUTLINE))
        label = f"{block.number}{fixture.letter(block.number)}"
        items.append(
            Words(label, view.at(foot[np.argmax(foot.sum(axis=1))]) + np.array([1.0, 0.0]), 1.2 * TEXT)
        )
    pose = np.linalg.inv(fixture.pose)
    centre = view.at(fixture.from_corner(pose[:3, 3]))
    if (centre > BORDER).all():
        items.append(Circle(centre, 1.2, Layer.CENTRES))
        for axis, name in ((0, "X robot"), (1, "Y robot")):
            tip = centre + 10.0 * pose[:2, axis]
            align = "left" if axis == 0 else "right"
            items += [Line(np.array([centre, tip]), Layer.CENTRES), Words(name, tip + 0.8, TEXT, align)]
    return items


def _ordinates(places: np.ndarray, view: View, width: float) -> list[Item]:
    """Places along x above the plate, along y left of it, spread where they would touch."""
    items: list[Item] = []
    for x, label in spread(places[:, 0] / view.scale, 4.2):
        start, foot = (
            view.origin + np.array([x, width / view.scale]),
            view.origin + np.array([label, width / view.scale + 10.0]),
        )
        items.append(Line(np.array([start + np.array([0, 1]), foot - [0, 3], foot]), Layer.DIMENSIONS))
        items.append(Words(f"{x * view.scale:z.3f}", foot + np.array([1.2, 1.0]), TEXT, "left", 90.0))
    for y, label in spread(places[:, 1] / view.scale, 4.2):
        start, foot = view.origin + np.array([0.0, y]), view.origin + np.array([-10.0, label])
        items.append(Line(np.array([start - [1, 0], foot + np.array([3, 0]), foot]), Layer.DIMENSIONS))
        items.append(Words(f"{y * view.scale:z.3f}", foot + np.array([-1.0, -1.2]), TEXT, "right"))
    return items


def _position_notes(fixture: Fixture) -> list[str]:
    across = f"position Ø{2 * MM * fixture.tolerances.place:.3f} to A B C"
    if not fixture.stock.doweled:
        return [f"Screw holes: {across}; mounting holes Ø0.2."]
    return [
        f"Dowel holes: {across}; screw and mounting holes Ø0.2;",
        f"the two dowel holes of a block Ø{MM * fixture.tolerances.pair:.3f} to each other.",
    ]


def _plate_notes(fixture: Fixture) -> list[str]:
    tolerances, pose = fixture.tolerances, np.linalg.inv(fixture.pose)
    x, y = fixture.from_corner(pose[:3, 3])
    return [
        "Datums: A top face, B lower edge, C left edge. Ordinates: the blocks' screw holes.",
        *_position_notes(fixture),
        "Ticks: low side of each block. Numbers: target and shape of its block.",
        f"Budget: {tolerances.note}.",
        f"Robot base at x {x:.2f}, y {y:.2f}, {MM * pose[2, 3]:+.2f} from A.",
    ]

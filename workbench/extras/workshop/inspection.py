"""The inspection list: what is checked on the finished parts, and how far it may be off."""

from collections.abc import Iterator

import numpy as np

from workbench.base import se3
from workbench.extras.workshop.csv_lists import MM, PIN_PLACE, RADIAL, csv_text
from workbench.extras.workshop.drawing_set import FLAT, LENGTH
from workbench.extras.workshop.parts import Bore, Fixture, Purpose
from workbench.plate.plate import Kind, Plate


def inspection_csv(plate: Plate, fixture: Fixture) -> str:
    """Inspection list: nominal, minimum and maximum value, and a column for the measured one."""
    head = ("item", "part", "feature", "unit", "nominal", "minimum", "maximum", "measured")
    checks = [
        *_checks_of_holes(fixture),
        *_checks_of_blocks(fixture),
        *_checks_of_probe(fixture),
        *_checks_of_targets(plate, fixture),
    ]
    rows = (
        (str(i), part, feature, unit, *(f"{v:z.4f}" for v in (nominal, nominal - bound, nominal + bound)), "")
        for i, (part, feature, unit, nominal, bound) in enumerate(checks, start=1)
    )
    return csv_text(head, rows)


Check = tuple[str, str, str, float, float]


def _checks_of_holes(fixture: Fixture) -> Iterator[Check]:
    bound = MM * fixture.tolerances.place
    for bore in fixture.slab.bores:
        if bore.purpose is Purpose.DOWEL:
            for axis, value in zip("xy", fixture.from_corner(bore.mouth), strict=True):
                yield "plate", f"dowel hole {bore.label} {axis}", "mm", value, bound


def _checks_of_blocks(fixture: Fixture) -> Iterator[Check]:
    tolerances = fixture.tolerances
    for block in fixture.blocks:
        name = f"block {block.number} ({fixture.letter(block.number)})"
        yield name, "height over B", "mm", MM * block.height, MM * tolerances.height
        yield name, "mitre", "deg", np.rad2deg(block.tilt), np.rad2deg(tolerances.mitre)
        if block.tilt > FLAT:
            yield name, "level lines of the face against C", "deg", 0.0, np.rad2deg(tolerances.mitre)
        if fixture.stock.doweled:
            distance = 2.0 * MM * tolerances.dowels
            yield name, "distance of the dowel holes", "mm", distance, 0.5 * MM * tolerances.pair
        for bore in block.bores:
            if bore.direction[2] < 0.0:
                yield from _checks_of_face(name, block.on_face(bore), bore, fixture)


def _checks_of_probe(fixture: Fixture) -> Iterator[Check]:
    """What the arm's tool is known from."""
    if fixture.probe is None:
        return
    yield "probe", "length from flange to face", "mm", MM * fixture.probe.length, LENGTH
    for bore in fixture.probe.bores:
        if bore.purpose is Purpose.PIN:
            for axis, value in zip("xy", MM * bore.mouth[:2], strict=True):
                yield "probe", f"pin {bore.label} {axis} from the axis", "mm", float(value), 0.5 * PIN_PLACE


def _checks_of_face(name: str, place: tuple[float, float], bore: Bore, fixture: Fixture) -> Iterator[Check]:
    tolerances = fixture.tolerances
    if bore.purpose is Purpose.INDEX:
        angle = float(np.rad2deg(np.arctan2(place[1], place[0])))
        yield name, "index hole from downhill", "deg", angle, np.rad2deg(tolerances.turn)
        yield name, "index hole from the seat", "mm", float(np.hypot(*place)), RADIAL
        return
    if bore.purpose is Purpose.MAGNET:  # holds the ball, does not place it
        return
    for axis, value in zip("uv", place, strict=True):
        yield name, f"{bore.purpose.split(',')[0]} {axis}", "mm", value, MM * tolerances.place


def _checks_of_targets(plate: Plate, fixture: Fixture) -> Iterator[Check]:
    production = fixture.tolerances.production
    poses = np.stack([target.pose for target in plate.mounted])
    heights = (se3.inverse(plate.pose) @ poses)[:, 2, 3]
    bounds = production.position + production.angle * heights  # a block that leans takes its face along
    angles = np.rad2deg(se3.matrix_to_rpy(poses[:, :3, :3]))
    held = "anchor" if fixture.anchored else "target"
    for number, (target, turned) in enumerate(zip(plate.mounted, angles, strict=True), start=1):
        for axis, value in zip("xyz", MM * target.xyz, strict=True):
            bound = MM * bounds[number - 1]
            yield f"{held} {number}", f"{axis} in the robot's base", "mm", float(value), bound
        if target.kind is Kind.SEAT:
            for axis, value in zip(("roll", "pitch", "yaw"), turned, strict=True):
                yield f"target {number}", axis, "deg", float(value), np.rad2deg(production.angle)

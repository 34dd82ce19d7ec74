"""Reports on a single arm: redundant constants of its model, axes from circle points."""

import numpy as np
from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from workbench.arm.robot import Robot
from workbench.base.wording import plural
from workbench.extras.geometry.circle_points import CircleAxis
from workbench.extras.geometry.redundant_constants import Redundancy, complete
from workbench.report.json import Json, plain
from workbench.report.numbers import short
from workbench.report.tables import headed

REDUNDANCY, AXES = "workbench.redundancy/1", "workbench.axes/1"


def redundancy_text(robot: Robot, found: Redundancy, *, frames: bool) -> RenderableType:
    """Number of independent constants, which may be removed, and what moves together."""
    lines = [f"{robot.name}: {plural(len(found.names), 'constant')}, {found.rank} independent"]
    if frames:
        lines.append(f"a complete model with base and tool has {complete(robot)}")
    lines.append(f"may be removed: {', '.join(found.redundant) or 'none'}")
    lines += [f"alike: {combination.text}" for combination in found.combinations]
    return Text("\n".join(lines))


def redundancy_json(robot: Robot, found: Redundancy) -> Json:
    """The same as plain data."""
    return plain(
        {
            "schema": REDUNDANCY,
            "robot": robot.name,
            "constants": list(found.names),
            "independent": list(found.independent),
            "redundant": list(found.redundant),
            "complete": complete(robot),
            "combinations": [
                {"names": list(c.names), "weights": list(c.weights), "words": c.text}
                for c in found.combinations
            ],
        }
    )


def axes_table(robot: Robot, axes: tuple[CircleAxis, ...]) -> RenderableType:
    """Each joint's axis as its circle shows it, against the model's."""
    table = Table(box=box.SIMPLE_HEAD)
    for heading in ("joint", "rows", "radius [mm]", "off the circle, rms [mm]", "tilted by [°]", "away [mm]"):
        table.add_column(heading, justify="right")
    for axis in axes:
        numbers = (1e3 * axis.radius, 1e3 * axis.rms, np.rad2deg(axis.angle), 1e3 * axis.distance)
        table.add_row(str(axis.joint + 1), str(len(axis.rows)), *(short(v) for v in numbers))
    return headed(f"axes of {robot.name} from circles", table)


def axes_json(robot: Robot, axes: tuple[CircleAxis, ...]) -> Json:
    """The same as plain data; joints count from 1, lengths in mm, angles in degrees."""
    return plain(
        {
            "schema": AXES,
            "robot": robot.name,
            "axes": [
                {
                    "joint": axis.joint + 1,
                    "rows": len(axis.rows),
                    "centre_mm": 1e3 * axis.centre,
                    "direction": axis.direction,
                    "radius_mm": 1e3 * axis.radius,
                    "rms_mm": 1e3 * axis.rms,
                    "angle_deg": np.rad2deg(axis.angle),
                    "distance_mm": 1e3 * axis.distance,
                }
                for axis in axes
            ],
        }
    )

"""Reports on a single arm: redundant constants of its model, axes from circle points."""

from rich.console import RenderableType
from rich.text import Text

from workbench.arm.robot import Robot
from workbench.base.wording import plural
from workbench.extras.geometry.circle_points import CircleAxis
from workbench.extras.geometry.redundant_constants import Redundancy, complete
from workbench.report.json import Json, document
from workbench.report.result_fields import DEG, JOINT, MM, ResultField, ResultFields
from workbench.report.tables import headed

REDUNDANCY, AXES = "workbench.redundancy/1", "workbench.axes/1"
COMBINATION = ResultFields("names", "weights", ResultField("words", of="text"))
AXIS = ResultFields(
    JOINT,
    ResultField("rows", of=lambda axis: len(axis.rows), title="rows"),
    ResultField("centre", MM),
    ResultField("direction"),
    ResultField("radius", MM, title="radius"),
    ResultField("rms", MM, title="off the circle, rms"),
    ResultField("angle", DEG, title="tilted by"),
    ResultField("distance", MM, title="away"),
)


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
    return document(
        REDUNDANCY,
        robot=robot.name,
        constants=found.names,
        independent=found.independent,
        redundant=found.redundant,
        complete=complete(robot),
        combinations=COMBINATION.each(found.combinations),
    )


def axes_table(robot: Robot, axes: tuple[CircleAxis, ...]) -> RenderableType:
    """Each joint's axis as its circle shows it, against the model's."""
    return headed(f"axes of {robot.name} from circles", AXIS.table("", axes))


def axes_json(robot: Robot, axes: tuple[CircleAxis, ...]) -> Json:
    """The same as plain data; joints count from 1, lengths in mm, angles in degrees."""
    return document(AXES, robot=robot.name, axes=AXIS.each(axes))

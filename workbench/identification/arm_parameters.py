"""The unknowns of an arm itself: its constants, the sizes of its effects, its masses."""

from collections.abc import Mapping, Sequence

from workbench.arm.parameters import Parameter
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError


def arm_parameters(
    robot: Robot,
    names: Sequence[str],
    effects: Sequence[str],
    bounds: Mapping[str, tuple[float, float]] | None,
) -> list[Parameter]:
    """Constants and coefficients by name, with their bounds."""
    arm = {e.name: e for e in robot.elements}
    if missing := [n for n in names if n not in arm]:
        raise OptionError(
            f"robot '{robot.name}' has no constant '{missing[0]}' to free; it has "
            f"{', '.join(n for n in arm if arm[n].matrix is None)}",
            option="free",
            found=missing[0],
        )
    if missing := [n for n in effects if n not in robot.coefficients]:
        raise OptionError(
            f"robot '{robot.name}' has no effect with the coefficient '{missing[0]}' to free; it has "
            f"{', '.join(robot.coefficients) or 'no effects'}",
            option="effects",
            found=missing[0],
        )
    units, sizes = robot.coefficient_units, robot.coefficients
    return [
        *(Parameter.bounded(n, arm[n].unit, arm[n].value, bounds) for n in names),
        *(Parameter.bounded(n, units[n], sizes[n], bounds, is_coefficient=True) for n in effects),
    ]


def inertia_parameters(robot: Robot, names: Sequence[str]) -> list[Parameter]:
    """Masses and centres by name."""
    units = ("kg" if n.endswith(".mass") else "m" for n in names)
    return [Parameter(n, u, robot.inertia[n], is_inertia=True) for n, u in zip(names, units, strict=True)]

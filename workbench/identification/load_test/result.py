"""What the experiment with inclinometers hands back."""

from dataclasses import dataclass

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.identification.load_test.postures import LoadingPlan, SideLoads
from workbench.identification.tilting import JointTilting, Tilting


@dataclass(frozen=True, eq=False, kw_only=True)
class LoadingResult:
    """An experiment and what it showed.

    Args:
        robot: The nominal arm.
        plan: Postures and masses.
        data: Readings of the inclinometers.
        tilting: What they showed.
        side: Sideways pulls for the upright joints; none if there are no such joints.
        side_tilting: What they showed, in the order of `side`.
        hidden: What the virtual arm has; empty if it is not known.
    """

    robot: Robot
    plan: LoadingPlan
    data: Dataset
    tilting: Tilting
    side: tuple[SideLoads, ...]
    side_tilting: tuple[Tilting, ...]
    hidden: tuple[JointTilting, ...]

    @property
    def joints(self) -> tuple[JointTilting, ...]:
        """What was found of every joint, in the order of the joints."""
        pulled = {j.joint: j for tilting in self.side_tilting for j in tilting.joints}
        return tuple(j.joined(pulled[j.joint]) if j.joint in pulled else j for j in self.tilting.joints)

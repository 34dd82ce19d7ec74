"""The arm on its ground: what a page shows while a session begins, and what its scene goes on with."""

import numpy as np
import viser

from workbench.arm.robot import Robot
from workbench.plate.plate import Plate
from workbench.views.drawables.nominal_arm import nominal_arm_at
from workbench.views.page.camera import aim_all, view_of_region
from workbench.views.page.scene.ground import Ground
from workbench.views.page.scene.viser_sink import PageSink


class FirstPicture:
    """Set up for an arm alone; its light stays: with another one a page makes all its shaders again.

    Attributes:
        ground: What the arm stands on.
        sink: What draws the arm.
    """

    def __init__(self, server: viser.ViserServer, robot: Robot):
        self.ground = Ground(server, robot)
        self.sink = PageSink(server)


def first_picture(server: viser.ViserServer, robot: Robot, plate: Plate) -> FirstPicture:
    """The arm at zero or near it, sent at once, and looked at from where the plate will be seen as well."""
    with server.atomic():
        drawn = FirstPicture(server, robot)
        drawn.ground.show(is_dark=False)
        drawn.sink.draw([nominal_arm_at(robot, np.clip(np.zeros(robot.dof), *robot.limits.T))])
        aim_all(server, *view_of_region(robot, plate.region))
    server.flush()
    return drawn

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
    """Drawn from an arm alone, at zero or the joint positions that are nearest to it.

    Its light stays: with another one a page makes all its shaders again.

    Attributes:
        ground: What the arm stands on.
        sink: What has drawn the arm.
    """

    def __init__(self, server: viser.ViserServer, robot: Robot):
        self.ground = Ground(server, robot)
        self.ground.show(is_dark=False)
        self.sink = PageSink(server)
        self.sink.draw([nominal_arm_at(robot, np.clip(np.zeros(robot.dof), *robot.limits.T))])


def first_picture(server: viser.ViserServer, robot: Robot, plate: Plate) -> FirstPicture:
    """Sent at once, and looked at from where the plate will be seen as well."""
    with server.atomic():
        drawn = FirstPicture(server, robot)
        aim_all(server, *view_of_region(robot, plate.region))
    server.flush()
    return drawn

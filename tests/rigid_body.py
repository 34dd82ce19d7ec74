"""A robot as a model of the pinocchio library: an independent check of poses and joint wrenches.

Every driven element becomes a joint about, or along, that axis of its own frame; the constants between two
driven elements become the placement of the later joint. Links are point masses at their centres of mass,
as a robot file knows no more of them. The universe frame is the measuring frame, so the robot's gravity is
turned by the base's orientation.

Source: Carpentier et al., The Pinocchio C++ library, IEEE/SICE SII 2019.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from workbench.arm import chain as chains
from workbench.arm.chain import Axis, Chain
from workbench.arm.robot import Robot
from workbench.base.types import JointRows, Poses, frozen

JOINTS = {
    Axis.RX: pin.JointModelRX,
    Axis.RY: pin.JointModelRY,
    Axis.RZ: pin.JointModelRZ,
    Axis.TX: pin.JointModelPX,
    Axis.TY: pin.JointModelPY,
    Axis.TZ: pin.JointModelPZ,
}


@dataclass(frozen=True, eq=False)
class RigidBody:
    """A robot's model in pinocchio.

    Args:
        model: One joint per driven element in the order of the chain, and the frame `tool`.
        tool: Number of the tool's frame in it.
        columns: Column of q that drives each of its joints.
    """

    model: pin.Model
    tool: int
    columns: Int[np.ndarray, " n"]

    def poses(self, q: JointRows) -> Poses:
        """Poses of the tool in the measuring frame, one row at a time."""
        data = self.model.createData()
        out = np.empty((len(q), 4, 4))
        for row in range(len(q)):
            pin.forwardKinematics(self.model, data, q[row, self.columns])
            out[row] = pin.updateFramePlacement(self.model, data, self.tool).homogeneous
        return out

    def wrenches(
        self, q: JointRows, *, velocity: JointRows | None = None, acceleration: JointRows | None = None
    ) -> Float[np.ndarray, "rows n 6"]:
        """Wrenches through the joints by the library's Newton–Euler recursion.

        Args:
            q: Joint positions [rad or m].
            velocity: Joint velocities [rad/s or m/s]; at rest if None.
            acceleration: Joint accelerations [rad/s² or m/s²]; none if None.

        Returns:
            [f; τ] as `statics.joint_wrenches` has them: by column of q, in each joint's own axes [N, N m].
        """
        data = self.model.createData()
        still = np.zeros_like(q)
        speed, change = (still if given is None else given for given in (velocity, acceleration))
        out = np.empty((*q.shape, 6))
        for row in range(len(q)):
            states = (part[row, self.columns] for part in (q, speed, change))
            pin.rnea(self.model, data, *states)
            for k, column in enumerate(self.columns, start=1):
                # pinocchio's axes move with the later link; ours stand on the earlier one
                motion = self.model.jointPlacements[k].actInv(data.liMi[k])
                out[row, column] = motion.act(data.f[k]).vector
        return out


def rigid_body(robot: Robot, *, massless: bool = False) -> RigidBody:
    """The robot's model in pinocchio.

    Args:
        robot: Geometry with base and tool.
        massless: Leave masses out, for poses of robots that have none.
    """
    model = pin.Model()
    model.name = robot.name
    model.gravity.linear = robot.base.rotation @ robot.gravity
    chain = robot.chain
    ends: dict[int, list[int]] = {}
    for link, end in enumerate(robot.chain_ends):
        ends.setdefault(end, []).append(link)
    parent, here, columns = 0, pin.SE3.Identity(), []
    for index, element in enumerate(chain.elements):
        if element.joint is not None:
            limits = robot.limits[element.joint]
            bounds = ([np.inf], [np.inf], *([float(v)] for v in limits))
            parent = model.addJoint(
                parent, JOINTS[element.axis](), here, f"joint{element.joint + 1}", *map(np.array, bounds)
            )
            here = pin.SE3.Identity()
            columns.append(element.joint)
        constant = chains.Element(element.axis, element.name, element.value, matrix=element.matrix)
        here = here * pin.SE3(chains.poses(Chain((constant,), 0), np.zeros((1, 0)))[0])
        for link in ends.get(index, ()):
            joint = robot.joints[link]
            model.addFrame(pin.Frame(f"link{link + 1}", parent, 0, here, pin.FrameType.BODY))
            if joint.mass and not massless:
                mass = pin.Inertia(joint.mass, np.array(joint.com), np.zeros((3, 3)))
                model.appendBodyToJoint(parent, mass, here)
    tool = model.addFrame(pin.Frame("tool", parent, 0, here, pin.FrameType.OP_FRAME))
    return RigidBody(model, tool, frozen(np.array(columns, np.int64)))

"""Names of an arm's joints in model files."""

from workbench.arm.robot import JointKind, Robot


def joint_names(robot: Robot) -> list[str]:
    """Names of the joints that move: those of the URDF, or joint1 …"""
    if robot.urdf is None:
        return [f"joint{k + 1}" for k in range(robot.dof)]
    pairs = zip(robot.urdf.joints, robot.joints, strict=True)
    return [name for name, joint in pairs if joint.kind is not JointKind.FIXED]

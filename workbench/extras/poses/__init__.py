"""Poses to measure at without a plate: the most informative within limits."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "plate cluster": "workbench.extras.poses.commands:cluster",
        "poses": "workbench.extras.poses.commands:poses",
    },
    root={
        "PoseLimits": "workbench.extras.poses.pose_limits:PoseLimits",
        "choose_poses": "workbench.extras.poses.choose_poses:choose_poses",
    },
)

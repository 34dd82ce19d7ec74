"""Trajectories: planned along a curve, and corrected with the calibrated arm."""

from workbench.parts import Parts

PARTS = Parts(
    commands={"compensate": "workbench.extras.trajectories.commands:compensate"},
    root={"compensate": "workbench.extras.trajectories.trajectory_files:compensate"},
)

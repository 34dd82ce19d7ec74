"""Trajectories: planned, played on both arms, and corrected."""

from workbench.parts import Parts

PARTS = Parts(
    commands={
        "compensate": "workbench.extras.trajectories.commands:compensate",
        "path": "workbench.extras.trajectories.commands:path",
    },
    root={"compensate": "workbench.extras.trajectories.trajectory_files:compensate"},
    session_commands=("workbench.extras.trajectories.session:PlanTrack",),
    panels=("workbench.extras.trajectories.panel:TrackPanel",),
    drawables=("workbench.extras.trajectories.drawables:track",),
    moving_drawables=("workbench.extras.trajectories.drawables:arm_on_trajectory",),
)

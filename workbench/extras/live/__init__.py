"""Guided measurement from a live source, and a virtual arm in place of one."""

from workbench.parts import Parts

PARTS = Parts(
    commands={"drive": "workbench.extras.live.commands:drive"},
    session_commands=("workbench.extras.live.session:MeasureLive",),
    panels=("workbench.extras.live.panels:GuidedPanel", "workbench.extras.live.panels:MeasuringPanel"),
    companions=("workbench.extras.live.commands:LiveOption",),
)

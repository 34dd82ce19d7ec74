"""Guided measurement from a live source, and a virtual arm in place of one."""

from workbench.parts import Parts

PARTS = Parts(
    commands={"drive": "workbench.extras.live.commands:drive"},
    session_commands=("workbench.extras.live.session:BeginMeasuring",),
    panels=("workbench.extras.live.panels:GuidedPanel", "workbench.extras.live.panels:MeasuringPanel"),
    watchers=("workbench.extras.live.sources:VirtualDriver",),
    companions=("workbench.extras.live.options:LiveOption",),
)

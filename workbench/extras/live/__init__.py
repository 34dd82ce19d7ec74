"""Guided measurement from a live source."""

from workbench.parts import Parts

PARTS = Parts(
    session_commands=("workbench.extras.live.session:MeasureLive",),
    panels=("workbench.extras.live.panels:GuidedPanel", "workbench.extras.live.panels:MeasuringPanel"),
    companions=("workbench.extras.live.commands:LiveOption",),
)

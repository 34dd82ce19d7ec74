"""`world/track`: the trajectory that is planned, and where the tool that errs goes."""

import rerun as rr

from workbench.views.appearance.colours import ARROW_AFTER, REACHED
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment


class Trajectory(AbstractEntity):
    """`world/track/wanted`, green, and `world/track/reached`, blue, exactly where they are."""

    def __init__(self) -> None:
        self._drawn: object = None

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        track = moment.session.track
        if track is self._drawn:
            return
        self._drawn = track
        canvas.clear("world/track")
        if track is None:
            return
        ways = {"wanted": (track.wanted, REACHED), "reached": (track.reached, ARROW_AFTER)}
        for name, (places, colour) in ways.items():
            canvas.log(f"world/track/{name}", rr.LineStrips3D([places], colors=colour, radii=0.0015))

"""`world/measured` and `world/errors`: measured positions, and arrows to where either arm is predicted."""

import numpy as np
import rerun as rr

from workbench.views.appearance.colours import (
    ARROW_AFTER,
    ARROW_BEFORE,
    MARK,
    REGION,
)
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment

MOST_ROWS = 400
"""Rows drawn at most; of more, evenly chosen ones."""


class Measured(AbstractEntity):
    """`world/measured`: yellow where fitted, grey where held out.

    `world/errors/nominal` and `world/errors/calibrated`: arrows from the measured position to the predicted
    one, exaggerated as on the page.
    """

    def __init__(self) -> None:
        self._drawn: tuple = (None, 0.0)

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        rows, scale = moment.session.comparison, moment.session.overlay.exaggeration
        if self._drawn == (rows, scale):
            return
        if rows is not self._drawn[0]:
            canvas.clear("world/measured")
            canvas.clear("world/errors")
        self._drawn = (rows, scale)
        if rows is None:
            return
        chosen = np.flatnonzero(np.isfinite(rows.measured).all(1))
        chosen = chosen[:: max(1, -(-len(chosen) // MOST_ROWS))]
        if not len(chosen):
            return
        start = rows.measured[chosen]
        colours = np.where(rows.held_out[chosen, None], REGION, MARK).astype(np.uint8)
        canvas.log("world/measured", rr.Points3D(start, colors=colours, radii=0.004))
        for name, poses, colour in (
            ("nominal", rows.nominal, ARROW_BEFORE),
            ("calibrated", rows.calibrated, ARROW_AFTER),
        ):
            if poses is not None:
                vectors = scale * (poses[chosen, :3, 3] - start)
                arrows = rr.Arrows3D(origins=start, vectors=vectors, colors=colour, radii=0.0015)
                canvas.log(f"world/errors/{name}", arrows)

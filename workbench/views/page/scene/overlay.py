"""What measurements lay over the scene: the calibrated arm, measured frames, and error arrows."""

import numpy as np
import viser

from workbench.base import se3
from workbench.session.commands.arm import standing
from workbench.session.commands.compare import ShowRow
from workbench.session.comparison import Comparison
from workbench.session.state import Focus, Overlay, Session
from workbench.session.worker import Worker
from workbench.views.appearance.colours import (
    ARROW_AFTER,
    ARROW_BEFORE,
    FITTED,
    GHOST,
    HELD_OUT,
    LEFT_OUT,
    MARK,
)
from workbench.views.appearance.shapes import ball
from workbench.views.page.scene.arm import Arm
from workbench.views.page.scene.nodes import linear
from workbench.views.page.scene.part import AbstractPart

POINT = 0.006
"""Radius of a measured place's ball [m]."""
MOST_ROWS = 400
"""Rows drawn at most; of more, evenly chosen ones."""


class OverlayPart(AbstractPart):
    """Drawn anew when the comparison changes; moved when another row is looked at."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._server, self._worker = server, worker
        self._left_out: frozenset[int] = frozenset()
        self._ghost: Arm | None = None
        self._drawn: Comparison | None = None
        self._overlay: Overlay | None = None
        self._nodes: dict[str, viser.SceneNodeHandle] = {}
        self.show(session)

    def show(self, session: Session) -> None:
        comparison, overlay = session.comparison, session.overlay
        changed = comparison is not self._drawn
        if changed:
            self._replace_ghost(session)
            self._draw_frames(comparison)
        if changed or session.left_out is not self._left_out:
            self._left_out = session.left_out
            self._draw_points(session)
        if changed or overlay is not self._overlay:
            self._draw_arrows(comparison, overlay)
        self._drawn, self._overlay = comparison, overlay
        rows = comparison if session.focus is Focus.ROW else None
        is_compared = session.focus in (Focus.ROW, Focus.JOG)
        if self._ghost is not None:
            self._ghost.visible = is_compared and overlay.calibrated
            if is_compared:
                self._ghost.stand(session.identification.runs[session.fit].calibrated, standing(session))
        for name in ("frames", "points"):
            if name in self._nodes:
                self._nodes[name].visible = overlay.frames and session.focus is not Focus.TRACK
        for name in ("before", "after"):
            if name in self._nodes:
                self._nodes[name].visible = is_compared
        self._mark(rows, session.row)

    def _replace_ghost(self, session: Session) -> None:
        if self._ghost is not None:
            self._ghost.remove()
            self._ghost = None
        if session.identification is not None:
            calibrated = session.identification.runs[session.fit].calibrated
            self._ghost = Arm(self._server, "/calibrated", calibrated, ghost=GHOST)

    def _remove(self, *names: str) -> None:
        for name in names:
            if name in self._nodes:
                self._nodes.pop(name).remove()

    def _draw_frames(self, comparison: Comparison | None) -> None:
        self._remove("frames", "mark")
        if comparison is None:
            return
        rows = _rows(comparison)
        if not len(rows):
            return
        if comparison.rotation is not None and np.isfinite(comparison.rotation[rows]).all():
            self._nodes["frames"] = self._server.scene.add_batched_axes(
                "/measured/frames",
                batched_wxyzs=se3.matrix_to_quaternion(comparison.rotation[rows]),
                batched_positions=comparison.measured[rows],
                axes_length=0.035,
                axes_radius=0.0016,
            )

    def _draw_points(self, session: Session) -> None:
        """A ball at every measured place, coloured by what the row is for; a click looks at the row."""
        self._remove("points")
        comparison = session.comparison
        rows = np.arange(0) if comparison is None else _rows(comparison)
        if comparison is None or not len(rows):
            return
        solid = ball(POINT, np.zeros(3))
        points = self._server.scene.add_batched_meshes_simple(
            "/measured/points",
            solid.vertices,
            solid.faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(rows), 1)),
            batched_positions=comparison.measured[rows],
            batched_colors=linear(row_colours(comparison, session.left_out)[rows]),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._nodes["points"] = points

        @points.on_click
        async def _(event: viser.SceneNodePointerEvent) -> None:
            self._worker.submit(ShowRow(int(rows[event.instance_index])))

    def _draw_arrows(self, comparison: Comparison | None, overlay: Overlay) -> None:
        self._remove("before", "after")
        if comparison is None or comparison.calibrated is None or not overlay.arrows:
            return
        rows = _rows(comparison)
        for name, predicted, colour in (
            ("before", comparison.nominal, ARROW_BEFORE),
            ("after", comparison.calibrated, ARROW_AFTER),
        ):
            start = comparison.measured[rows]
            end = start + overlay.exaggeration * (predicted[rows, :3, 3] - start)
            if len(rows):
                self._nodes[name] = self._server.scene.add_arrows(
                    f"/errors/{name}",
                    np.stack([start, end], 1),
                    colors=colour,
                    shaft_radius=0.0018,
                    head_radius=0.0045,
                    head_length=0.012,
                )

    def _mark(self, rows: Comparison | None, row: int) -> None:
        """A ball where the looked-at row was measured."""
        place = np.full(3, np.nan) if rows is None else rows.measured[row]
        if not np.isfinite(place).all():
            self._remove("mark")
            return
        if "mark" not in self._nodes:
            self._nodes["mark"] = self._server.scene.add_icosphere(
                "/measured/mark",
                radius=0.012,
                color=MARK,
                opacity=0.75,
                cast_shadow=False,
                receive_shadow=False,
            )
        self._nodes["mark"].position = place


def row_colours(comparison: Comparison, left_out: frozenset[int]) -> np.ndarray:
    """Colour of every row: fitted, held out, or left out by hand."""
    colours = np.where(comparison.held_out[:, None], HELD_OUT, FITTED)
    out = np.isin(comparison.number, list(left_out)) & ~comparison.held_out
    return np.where(out[:, None], LEFT_OUT, colours).astype(np.uint8)


def _rows(comparison: Comparison) -> np.ndarray:
    rows = np.flatnonzero(np.isfinite(comparison.measured).all(1))
    return rows[:: max(1, -(-len(rows) // MOST_ROWS))]

"""What measurements lay over the scene: the calibrated arm, measured frames, and error arrows."""

import numpy as np
import viser

from workbench import se3
from workbench.app.scene.arm import Arm
from workbench.app.scene.part import AbstractPart
from workbench.appearance.colours import ARROW_AFTER, ARROW_BEFORE, GHOST, MARK
from workbench.session.comparison import Comparison
from workbench.session.state import Focus, Overlay, Session

MOST_ROWS = 400
"""Rows drawn at most; of more, evenly chosen ones."""


class OverlayPart(AbstractPart):
    """Drawn anew when the comparison changes; moved when another row is looked at."""

    def __init__(self, server: viser.ViserServer, session: Session):
        self._server = server
        self._ghost: Arm | None = None
        self._drawn: Comparison | None = None
        self._overlay: Overlay | None = None
        self._nodes: dict[str, viser.SceneNodeHandle] = {}
        self.show(session)

    def show(self, session: Session) -> None:
        """Draw what has changed."""
        comparison, overlay = session.comparison, session.overlay
        changed = comparison is not self._drawn
        if changed:
            self._replace_ghost(session)
            self._draw_frames(comparison)
        if changed or overlay is not self._overlay:
            self._draw_arrows(comparison, overlay)
        self._drawn, self._overlay = comparison, overlay
        rows = comparison if session.focus is Focus.ROW else None
        if self._ghost is not None:
            self._ghost.visible = rows is not None and overlay.calibrated
            if rows is not None:
                self._ghost.stand(session.identification.runs[session.fit].calibrated, rows.q[session.row])
        if "frames" in self._nodes:
            self._nodes["frames"].visible = overlay.frames
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
        else:
            self._nodes["frames"] = self._server.scene.add_point_cloud(
                "/measured/points",
                comparison.measured[rows],
                colors=MARK,
                point_size=0.006,
                point_shape="circle",
            )

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


def _rows(comparison: Comparison) -> np.ndarray:
    rows = np.flatnonzero(np.isfinite(comparison.measured).all(1))
    return rows[:: max(1, -(-len(rows) // MOST_ROWS))]

"""Cameras: the frustum of each, the target in front of it, and the uncertainty of the tool."""

from collections.abc import Iterator

import numpy as np

from workbench.base import se3
from workbench.extras.camera.camera_view import camera_views, tool_covariance
from workbench.session.commands.arm import drawn_joints
from workbench.session.state import Focus, Session
from workbench.views.appearance.colours import CALIBRATED, FITTED, MARK
from workbench.views.appearance.shapes import Solid, ball, box
from workbench.views.drawables.drawable import Label, Line, Mesh
from workbench.views.drawables.sink import Item

DEPTH = 0.12
"""How far a frustum is drawn [m]."""
CORNER = 0.0018
"""Half size of the target's points as drawn [m]."""
SHOWN = 0.04
"""Longest half axis of the ellipsoid as drawn, where a round factor allows [m]."""
EDGES = (0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1)
"""Apex and corners in an order that draws every edge."""


def cameras(session: Session) -> Iterator[Item]:
    """Frusta and target for the arm's current posture."""
    views = camera_views(session)
    is_shown = session.playback.focus is not Focus.TRACK
    for view in views:
        is_placed = is_shown and bool(np.isfinite(view.pose).all())
        yield Item(f"camera/{view.name}", _frustum, (view.pose, view.frame), shown=is_placed)
    if views:
        target = views[0].target
        yield Item("camera/target", _target, (target[np.isfinite(target[:, 0])],), shown=is_shown)


def ellipsoid(session: Session) -> Iterator[Item]:
    """95 % confidence ellipsoid of the tool, enlarged by a factor shown beside it."""
    covariance = tool_covariance(session)
    if covariance is None or session.playback.focus is Focus.TRACK:
        return
    place = session.robot.predict(drawn_joints(session)[None])[0]
    place = (se3.inverse(session.robot.base.pose) @ place)[:3, 3]
    half = 2.796 * np.sqrt(np.linalg.eigvalsh(covariance))  # χ² of three, 95 %
    times = _round_factor(SHOWN / max(float(half[-1]), 1e-9))
    yield Item("camera/ellipsoid", _ellipsoid, (covariance, place, times))
    text = f"tool ±{1e3 * half[-1]:.2g} mm (95 %), drawn × {times:g}"
    yield Item("camera/ellipsoid_words", _label, (text, place))


def _frustum(pose: np.ndarray, frame: np.ndarray) -> Line:
    corners = DEPTH * np.vstack([np.zeros(3), np.column_stack([frame, np.ones(4)])])
    places = se3.apply(pose[None], corners[None])[0][list(EDGES)]
    return Line(places=places, colours=np.tile(np.array(MARK, np.uint8), (len(EDGES), 1)), pixels=2.0)


def _target(points: np.ndarray) -> Mesh:
    """A small cube at every point: as one solid, since clicks on points mean rows."""
    unit = box(np.full(3, 2.0 * CORNER))
    faces = unit.faces[None] + len(unit.vertices) * np.arange(len(points))[:, None, None]
    solid = Solid((points[:, None] + unit.vertices).reshape(-1, 3), faces.reshape(-1, 3))
    return Mesh(solid=solid, colour=FITTED, flat=True)


def _ellipsoid(covariance: np.ndarray, place: np.ndarray, times: float) -> Mesh:
    size, axes = np.linalg.eigh(covariance)
    half = np.maximum(2.796 * times * np.sqrt(np.maximum(size, 0.0)), 5e-4)
    axes = axes if np.linalg.det(axes) > 0.0 else -axes
    unit = ball(1.0, np.zeros(3))
    solid = Solid(unit.vertices @ (axes * half).T, unit.faces)
    return Mesh(solid=solid, colour=CALIBRATED, opacity=0.45, pose=se3.pose(np.eye(3), place))


def _label(text: str, place: np.ndarray) -> Label:
    return Label(text=text, place=place + np.array([0.0, 0.0, 0.06]))


def _round_factor(maximum: float) -> float:
    """The largest 1, 2, 5, 10 … up to this."""
    digit = 10.0 ** np.floor(np.log10(max(maximum, 1.0)))
    return float(max(n * digit for n in (1, 2, 5) if n * digit <= max(maximum, 1.0)))

"""A trajectory: the planned path, the tool's path with its errors, and the arm moving along it."""

from collections.abc import Iterator

import numpy as np

from workbench.extras.trajectories.session import Track, planned_track
from workbench.session.played_motion import Played
from workbench.session.state import Focus, Session
from workbench.views.appearance.colours import REGION, scale_colours
from workbench.views.drawables.arms import real_arm
from workbench.views.drawables.drawable import Colour, Line
from workbench.views.drawables.measured import mark
from workbench.views.drawables.sink import Item

MIN_DRAWN_ERROR = 1e-6
"""Errors below this are drawn as zero [m]."""


def track(session: Session) -> Iterator[Item]:
    """The planned path, and that of the real tool, its errors exaggerated."""
    planned = planned_track(session)
    if planned is not None:
        is_shown = session.playback.focus is Focus.TRACK
        yield Item("track/wanted", _line, (planned.wanted, REGION), shown=is_shown)
        yield Item("track/trail", _trail, (planned, session.choices.overlay.exaggeration), shown=is_shown)


def arm_on_trajectory(session: Session) -> Iterator[Item]:
    """The erring arm, and the wanted place."""
    planned, played = planned_track(session), session.part(Played)
    if planned is None or played is None:
        return
    at, overlay = played.at, session.choices.overlay
    is_shown = session.playback.focus is Focus.TRACK
    if planned.sent is not None:
        inputs = planned.robot, planned.sent.calibrated, None, planned.at(at), None, overlay.exaggeration
        yield Item("track/arm", real_arm, inputs, shown=is_shown and overlay.calibrated)
    place = np.array([np.interp(at, planned.planned.time, c) for c in planned.wanted.T])
    yield Item("track/mark", mark, (0.008, place), shown=is_shown)


def _line(places: np.ndarray, colour: Colour) -> Line:
    return Line(places=places, colours=np.array([colour], np.uint8), pixels=1.5)


def _trail(track: Track, times: float) -> Line:
    """In colours from good where the error is smallest to bad where it is largest."""
    places, errors = track.wanted + times * (track.reached - track.wanted), track.errors
    low, high = float(errors.min()), float(errors.max())
    spread = errors - low if high > MIN_DRAWN_ERROR else np.zeros(len(errors))
    colours = scale_colours(1.0 - spread / max(high - low, MIN_DRAWN_ERROR))
    return Line(places=places, colours=colours, pixels=5.0)

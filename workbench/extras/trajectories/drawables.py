"""A trajectory: the planned path, the actual tool path, and the moving arm with its trail of errors."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int, UInt8

from workbench.extras.trajectories.track import Track, planned_track
from workbench.session.played_motion import Played
from workbench.session.state import Focus, Session
from workbench.views.appearance.colours import CALIBRATED, REGION, scale_colours
from workbench.views.drawables.arms import real_arm
from workbench.views.drawables.drawable import Colour, Line
from workbench.views.drawables.measured import mark
from workbench.views.drawables.sink import Item

PIECES = 48
"""Parts in which the trail grows."""
MIN_DRAWN_ERROR = 1e-6
"""Errors below this are drawn as zero [m]."""


def track(session: Session) -> Iterator[Item]:
    """The planned path, and that of the real tool, its errors exaggerated."""
    planned, times = planned_track(session), session.choices.overlay.exaggeration
    if planned is not None:
        is_shown = session.playback.focus is Focus.TRACK
        yield Item("track/wanted", _line, (planned.wanted, REGION), shown=is_shown)
        yield Item("track/reached", _reached, (planned, times), shown=is_shown)


def arm_on_trajectory(session: Session) -> Iterator[Item]:
    """The erring arm, the wanted place, and the trail up to it, its errors exaggerated."""
    planned, played = planned_track(session), session.part(Played)
    if planned is None or played is None:
        return
    at, overlay = played.at, session.choices.overlay
    is_shown = session.playback.focus is Focus.TRACK
    if planned.actual is not None:
        inputs = planned.robot, planned.actual, None, planned.at(at), None, overlay.exaggeration
        yield Item("track/arm", real_arm, inputs, shown=is_shown and overlay.calibrated)
    place = np.array([np.interp(at, planned.time, c) for c in planned.wanted.T])
    yield Item("track/mark", mark, (0.008, place), shown=is_shown)
    row, begin = np.interp(at, planned.time, np.arange(len(planned.time))), 0
    for i, end in enumerate(piece_ends(len(planned.time) - 1).tolist()):
        piece, is_past = (planned, overlay.exaggeration, begin, end), end <= row + 1e-9
        yield Item(f"track/trail/{i}", _trail, piece, shown=is_shown and is_past)
        begin = end


def _line(places: np.ndarray, colour: Colour) -> Line:
    return Line(places=places, colours=np.array([colour], np.uint8), pixels=1.5)


def _reached(track: Track, times: float) -> Line:
    return _line(track.wanted + times * (track.reached - track.wanted), CALIBRATED)


def _trail(track: Track, times: float, begin: int, end: int) -> Line:
    piece = slice(begin, end + 1)
    places = _reached(track, times).places
    return Line(places=places[piece], colours=trail_colours(track.errors)[piece], pixels=5.0)


def trail_colours(errors: Float[np.ndarray, " rows"]) -> UInt8[np.ndarray, "rows 3"]:
    """Colours of the trail: from good where the error is smallest to bad where it is largest."""
    low, high = float(errors.min()), float(errors.max())
    is_seen = high > MIN_DRAWN_ERROR
    return scale_colours(1.0 - is_seen * (errors - low) / max(high - low, MIN_DRAWN_ERROR))


def piece_ends(segments: int) -> Int[np.ndarray, " pieces"]:
    """Segments after which the pieces of a trail end."""
    return np.unique(np.linspace(0, segments, PIECES + 1).round().astype(int))[1:]

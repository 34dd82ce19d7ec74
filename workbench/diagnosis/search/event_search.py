"""Candidate events: an exhaustive search over all times for every kind of step and warm-up.

The column of an event is a geometric one (the frame, the tool, a joint's zero) weighted by w over time: its
inner products with any other column are sums over pieces of time, Σ w P, which are running sums for a step.
With geometry and model projected out, each time needs a system of the event's size only:

    gain = ½ N' log (S / (S − aᵀ A⁻¹ a)) − ½ k log N − log (places tried)

The best place of each kind and joint becomes a candidate like any other. Rows are in measuring order: by time
if every row has one, else as in the file.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.effects import Candidate
from workbench.arm.effects.events import (
    NEVER_ROW,
    WARM_AT,
    AbstractEvent,
    AbstractStep,
    FrameStep,
    ToolStep,
    WarmUp,
    ZeroStep,
)
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import clock_of
from workbench.diagnosis.search.evidence import MIN_INDEPENDENT_SHARE, Model, left_of, projection
from workbench.diagnosis.search.gram_matrices import MIN_COLUMN_LENGTH, Grams
from workbench.identification.frames import visible_parts
from workbench.identification.problem import Problem

MIN_SIDE = 3
"""Minimum number of rows on either side of a step, also within its session unless that begins with it."""
EVENT_PRIOR_ODDS = 20
"""Prior odds of an event relative to an effect of the arm."""
MIN_EVENT_SHARE = 0.08
"""Share of the residual that an event must explain to be tried; smaller ones could not be claimed."""
PACES = np.geomspace(1.0 / 30.0, 0.4, 65)
"""Time constants to try, as shares of the total duration; the last one is that of a drift without an end."""
MAX_PIECES = 160
"""Maximum number of pieces of time for the event search; near events that were found, every row is a
piece."""
SINGLE_ROW_PIECES = 3
"""Number of pieces on either side of a found event in which every row is a separate piece."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """Rows in measuring order, divided into consecutive pieces.

    Args:
        clock: Key that orders the rows: times [s], or numbers in the file.
        is_timed: Whether it is time.
        row: Their numbers in the file.
        piece: Piece of every row, counted from 0.
        session: Session of every row, counted from 0.
    """

    clock: Float[np.ndarray, " rows"]
    is_timed: bool
    row: Int[np.ndarray, " rows"]
    piece: Int[np.ndarray, " rows"]
    session: Int[np.ndarray, " rows"]

    @classmethod
    def of(cls, data: Dataset, near: Sequence[float] = ()) -> "Timeline":
        """Of some rows, each a separate piece `near` some clock readings."""
        clock, is_timed = clock_of(data)
        known = np.unique(clock)
        bounds = np.unique(np.linspace(0, len(known), min(len(known), MAX_PIECES) + 1).round().astype(int))
        reach = SINGLE_ROW_PIECES * (len(known) // MAX_PIECES + 1)
        for moment in near if len(known) > MAX_PIECES else ():
            place = int(np.searchsorted(known, moment))
            bounds = np.union1d(bounds, np.arange(max(place - reach, 0), min(place + reach, len(known)) + 1))
        piece = np.searchsorted(bounds, np.searchsorted(known, clock), side="right") - 1
        named = np.zeros(len(data), int) if data.session is None else np.asarray(data.session)
        session = np.unique(named, return_inverse=True)[1].reshape(-1)
        return cls(clock, is_timed, np.asarray(data.row), piece, session)

    @cached_property
    def order(self) -> Int[np.ndarray, " rows"]:
        """Indices of the rows in measuring order."""
        return np.lexsort((self.row, self.clock))

    @cached_property
    def first(self) -> Int[np.ndarray, " pieces"]:
        """Index of the first row of every piece."""
        return self.order[np.flatnonzero(np.diff(self.piece[self.order], prepend=-1))]

    def timed(self, event: AbstractEvent, place: int, **settings: Any) -> AbstractEvent:
        """An event at one of the rows, with further settings."""
        time = float(self.clock[place]) if self.is_timed else 0.0
        return replace(event, row=int(self.row[place]), time_s=time, is_timed=self.is_timed, **settings)

    @cached_property
    def middle(self) -> Float[np.ndarray, " pieces"]:
        """Mean clock reading of every piece."""
        return np.bincount(self.piece, self.clock) / np.bincount(self.piece)

    @cached_property
    def before(self) -> Int[np.ndarray, " pieces"]:
        """Number of rows before every piece."""
        return np.concatenate([[0], np.cumsum(np.bincount(self.piece))[:-1]])

    @cached_property
    def sides(self) -> Int[np.ndarray, "pieces 2"]:
        """Number of rows of a piece's first session before it, and from it on."""
        session = self.session[self.order]
        mine = session == self.session[self.first][:, None]
        is_before = np.arange(len(session)) < self.before[:, None]
        return np.column_stack([(mine & is_before).sum(1), (mine & ~is_before).sum(1)])


def crowded(
    marked: Bool[np.ndarray, " rows"], data: Dataset, *, within: int, fewest: int
) -> Bool[np.ndarray, " rows"]:
    """Marked rows of which at least `fewest` lie among `within` consecutive ones."""
    order, window = np.lexsort((np.asarray(data.row), clock_of(data)[0])), np.ones(within)
    many, out = np.convolve(marked[order], window) > fewest - 0.5, np.zeros(len(marked), bool)
    out[order] = np.convolve(many, window)[within - 1 : within - 1 + len(marked)] > 0.5
    return out & marked


@dataclass(frozen=True, eq=False)
class Changeable:
    """What an event may change: its columns in the history, the latest time of the event, and whether the
    file declares it known, which it then is on one side of a step."""

    event: AbstractStep
    columns: slice
    is_known: bool


def changeable(problem: Problem) -> tuple[Changeable, ...]:
    """The frame, the tool and every joint's zero, as far as they are observable in the rows."""
    tool = visible_parts(problem.data, problem.known)[1]
    several = any(b.observation.is_tool_free and len(b.observation.unknowns) > 3 for b in problem.blocks)
    events: list[AbstractStep] = [FrameStep(row=NEVER_ROW)] * _places_frame(problem)
    if tool or several:  # markers' common motion is a tool step
        events.append(ToolStep(row=NEVER_ROW, turns=several or len(tool) > 3))
    events += [ZeroStep((j,), row=NEVER_ROW) for j in range(problem.robot.dof)]
    known = {FrameStep: not problem.frames.base, ToolStep: not (problem.frames.tool or several)}
    out, start = [], 0
    for event in events:
        mine = slice(start, start := start + len(event.names))
        out.append(Changeable(event, mine, known.get(type(event), False)))
    return tuple(out)


def _places_frame(problem: Problem) -> bool:
    """Whether rows tell a step of the frame from contacts that moved: these were touched before and after."""
    if problem.sees_base or (labels := problem.data.contact) is None:
        return True
    mine = (clock_of(problem.data)[0][labels == label] for label in np.unique(labels))
    first, last = np.array([(each.min(), each.max()) for each in mine]).T
    return bool(max(((first < moment) & (moment <= last)).sum() for moment in last) >= MIN_SIDE)


def promising(grams: Grams, model: Model, line: Timeline, kinds: Sequence[Changeable]) -> list[Candidate]:
    """The best time for every kind of event beside a model, if the evidence prefers it to none; `line` is in
    the pieces of the history of what these kinds may change."""
    if grams.history is None or not kinds:
        return []
    columns, gains_of = _event_gains(grams, model)
    history = grams.history[:, :, columns]
    running, size = history.cumsum(0), len(columns) - history.shape[1]
    is_place = (line.before >= MIN_SIDE) & (line.before <= len(line.row) - MIN_SIDE)
    if np.ptp(line.session):
        is_place &= (line.sides[:, 0] == 0) | (line.sides.min(1) >= MIN_SIDE)
    steps = np.flatnonzero(is_place)
    span, begin = float(np.ptp(line.clock)), float(line.clock.min())
    weights = np.exp(-(line.middle - begin) / (PACES[:, None] * span)) if span > 0.0 else np.zeros((0, 1))
    found = []
    for kind in kinds:
        mine = kind.columns
        if len(steps):
            before = running[steps - 1, mine]
            sides = [before, running[-1, mine] - before] if kind.is_known else [before]
            gains = np.stack([gains_of(s[:, :, :size], s[:, :, size:][:, :, mine]) for s in sides])
            side, place = divmod(int(np.argmax(gains)), len(steps))
            if gains[side, place] > 0.0:
                step = line.timed(kind.event, int(line.first[steps[place]]), known_before=bool(side))
                found.append(Candidate(step, tries=EVENT_PRIOR_ODDS * gains.size))
        if len(weights) and not isinstance(kind.event, ToolStep):
            sums, squares = (np.tensordot(w, history[:, mine], 1) for w in (weights, weights**2))
            gains = gains_of(sums[:, :, :size], squares[:, :, size:][:, :, mine])
            best = int(np.argmax(gains))
            if gains[best] > 0.0 and best + 1 < len(PACES):
                pace, ordered = float(PACES[best] * span), line.clock[line.order]
                over = min(int(np.searchsorted(ordered, begin + WARM_AT * pace)), len(ordered) - 1)
                warm_up = WarmUp(kind.event.joints, begin=begin, pace=pace)  # from the first row on
                event = line.timed(warm_up, int(line.order[over]))
                found.append(Candidate(event, tries=EVENT_PRIOR_ODDS * len(weights)))
    return found


def _event_gains(
    grams: Grams, model: Model
) -> tuple[Int[np.ndarray, " n1u"], Callable[[np.ndarray, np.ndarray], Float[np.ndarray, " places"]]]:
    """Columns of the history that are needed: those of a model, the residual, what may change; and the log
    evidence of an event at each place, by the inner products (places, k, ·) of its columns with those of the
    model and the residual, and with each other."""
    assert grams.history is not None, "the history was requested"
    (used, project), size, left = projection(grams, model), len(grams.total), left_of(grams, model)
    explained = project(grams.total[-1:, used])[0]

    def gains(sums: np.ndarray, raw: np.ndarray) -> np.ndarray:
        places, k, _ = sums.shape
        half = project(sums[:, :, :-1].reshape(places * k, -1)).reshape(places, k, -1)
        along = sums[:, :, -1] - half @ explained
        length = np.sqrt(np.maximum(np.diagonal(raw, axis1=1, axis2=2), MIN_COLUMN_LENGTH**2))
        inner = (raw - half @ half.transpose(0, 2, 1)) / (length[:, :, None] * length[:, None, :])
        value, vectors = np.linalg.eigh(inner)
        seen = value > MIN_INDEPENDENT_SHARE
        onto = ((vectors.transpose(0, 2, 1) @ (along / length)[..., None])[..., 0] ** 2) * seen
        rest = left.square - (onto / np.where(seen, value, 1.0)).sum(1)
        ratio = np.log(left.square / np.maximum(rest, 1e-12 * left.square))
        charge = 0.5 * seen.sum(1) * np.log(grams.count) + np.log(EVENT_PRIOR_ODDS * places)
        promising = seen.any(1) & (rest < (1.0 - MIN_EVENT_SHARE) * left.square)
        return np.where(promising, 0.5 * left.freedom * ratio - charge, -np.inf)

    return np.concatenate([used, np.arange(size - 1, grams.history.shape[2])]), gains

"""Sessions compared: what differs at their ends, and which parameters have moved over time.

A parameter has moved when the difference of two identifications is beyond chance: more than three times the
root of the sum of their squared standard errors. Constants that either could not see are left out, and so are
those that move together with others, whose shares are only conventional. Parameters of different arms have
nothing to do with each other: only errors and indices are then compared.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from workbench.base.errors import WorkbenchError
from workbench.base.progress import part_of
from workbench.base.wording import plural
from workbench.identification.checks.arm_match import require_same_arm
from workbench.identification.fit import Fit
from workbench.identification.result import judged
from workbench.report.json import document
from workbench.report.numbers import signed
from workbench.report.result_fields import ResultField, ResultFields
from workbench.session.journal.reader import Recording
from workbench.session.journal.restore import restore
from workbench.session.state import Session

BEYOND_CHANCE = 3.0
"""Standard errors; of thirty constants that did not move, one in twelve comparisons shows one beyond it."""
UNITS = {"rad": (1e3, "mrad"), "m": (1e3, "mm")}


@dataclass(frozen=True)
class Figure:
    """One number of every session; NaN where a session has none."""

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Move:
    """One parameter over the sessions, in rad or m, with standard errors; NaN where it was not identified."""

    name: str
    unit: str
    values: tuple[float, ...]
    stds: tuple[float, ...]

    @property
    def ratios(self) -> tuple[float, ...]:
        """Change against the first session in standard errors of the difference; NaN where unknown."""
        return tuple(
            (value - self.values[0]) / math.hypot(std, self.stds[0]) if std or self.stds[0] else math.nan
            for value, std in zip(self.values, self.stds, strict=True)
        )

    @property
    def has_moved(self) -> bool:
        """Whether any session's value is beyond chance."""
        return any(abs(ratio) > BEYOND_CHANCE for ratio in self.ratios if math.isfinite(ratio))


MOVE = ResultFields(
    *("name", "unit", "values", "stds"),
    ResultField("moved", of="has_moved"),
    ResultField("standard_errors", of="ratios"),
)


@dataclass(frozen=True)
class ComparedSessions:
    """Several sessions beside each other: numbers at their ends, their parameters, and what to beware of.

    `others` says why a session's arm is not that of the first one; there are no moves if any is another.
    """

    names: tuple[str, ...]
    figures: tuple[Figure, ...]
    moves: tuple[Move, ...]
    notes: tuple[str, ...] = ()
    others: tuple[str, ...] = ()

    @property
    def moved(self) -> tuple[Move, ...]:
        """Parameters that moved beyond chance, the clearest first."""
        found = [move for move in self.moves if move.has_moved]
        return tuple(sorted(found, key=lambda m: -np.nanmax(np.abs(m.ratios))))

    def tables(self) -> RenderableType:
        figures = Table("", *self.names, box=None)
        for figure in self.figures:
            figures.add_row(escape(figure.name), *map(_short, figure.values))
        parts: list[RenderableType] = [figures, Text("")]
        if self.moves:
            moves = Table("parameter", *self.names, "", "moved", box=None)
            for name, cells, unit, ratio in self._rows():
                moves.add_row(name, *cells, unit, ratio)
            parts += [moves] if self.moved else []
        if self.sentence:
            parts.append(Text(self.sentence))
        return Group(*parts)

    def markdown(self) -> str:
        names = " | ".join(self.names)
        lines = [f"**{self.sentence}**", ""] if self.sentence else []
        if self.moved:
            lines += [f"| parameter | {names} | | moved |", "|---|" + "---:|" * len(self.names) + "---|---:|"]
            lines += [f"| {n} | {' | '.join(cells)} | {u} | {r} |" for n, cells, u, r in self._rows()]
            lines.append("")
        lines += [f"| | {names} |", "|---|" + "---:|" * len(self.names)]
        lines += [f"| {f.name} | {' | '.join(map(_short, f.values))} |" for f in self.figures]
        return "\n".join(lines)

    @property
    def sentence(self) -> str:
        """What moved, in words; why no parameters are compared; empty where none were identified."""
        if self.others:
            return f"Parameters are not compared: {'; '.join(self.others)}."
        if not self.moves:
            return ""
        count, all_ = len(self.moved), len(self.moves)
        if not count:
            return f"None of {all_} parameters moved by more than {BEYOND_CHANCE:g} standard errors."
        return f"{count} of {all_} parameters moved by more than {BEYOND_CHANCE:g} standard errors."

    def json(self) -> dict[str, Any]:
        return document(
            "workbench.comparison/1",
            sessions=self.names,
            other_arms=self.others,
            figures={figure.name: list(figure.values) for figure in self.figures},
            parameters=MOVE.each(self.moves),
        )

    def _rows(self) -> Iterator[tuple[str, list[str], str, str]]:
        for move in self.moved:
            scale, unit = UNITS.get(move.unit, (1.0, move.unit))
            cells = [
                f"{signed(scale * v, 3)} ± {scale * s:.2g}" if math.isfinite(v) else "–"
                for v, s in zip(move.values, move.stds, strict=True)
            ]
            yield move.name, cells, unit, f"{np.nanmax(np.abs(move.ratios)):.1f} σ"


def compare(recordings: Sequence[Recording]) -> ComparedSessions:
    """Compare the last states of recordings, in the order given."""
    names, share = [recording.folder.name for recording in recordings], 1.0 / max(len(recordings), 1)
    restored = []
    for i, recording in enumerate(recordings):
        with part_of(share * i, share):
            restored.append(restore(recording))
    notes = tuple(found.warning for found in restored if found.warning)
    return replace(compare_sessions(names, [found.session for found in restored]), notes=notes)


def compare_sessions(names: Sequence[str], sessions: Sequence[Session]) -> ComparedSessions:
    """Compare sessions, in the order given."""
    numbers = [dict(_figures(session)) for session in sessions]
    every = dict.fromkeys(name for found in numbers for name in found)
    figures = tuple(Figure(name, tuple(found.get(name, math.nan) for found in numbers)) for name in every)
    others = tuple(_others(names, sessions))
    fits = [s.results.run.fit for s in sessions if s.results.run is not None]
    moves = _moves(fits) if len(fits) == len(sessions) and not others else ()
    return ComparedSessions(tuple(names), figures, moves, others=others)


def _others(names: Sequence[str], sessions: Sequence[Session]) -> Iterator[str]:
    """Sessions of another arm than the first one's."""
    first = sessions[0].robot
    for name, session in zip(names[1:], sessions[1:], strict=True):
        try:
            require_same_arm(session.robot, first)
        except WorkbenchError:
            arms = (f"{arm.name} with {plural(arm.dof, 'joint')}" for arm in (session.robot, first))
            yield f"{name} and {names[0]} are of different arms ({', not '.join(arms)})"


def _figures(session: Session) -> Iterator[tuple[str, float]]:
    score = session.score
    yield "measurable targets", float(score.measurable)
    for name, value in score.indices.items():
        yield f"index {name}", float(value)
    yield "predicted error [mm]", 1e3 * score.position
    yield "predicted error [°]", math.degrees(score.rotation)
    found, run = session.results.identification, session.results.run
    if found is not None and run is not None:
        for text, errors in (("before", found.nominal), ("after", run)):
            yield f"mean error {text} [mm]", judged(errors).position_mm.mean
            yield f"maximum error {text} [mm]", judged(errors).position_mm.max


def _moves(fits: Sequence[Fit]) -> tuple[Move, ...]:
    """Constants of the arm that all fits can separate from the others; base and tool may differ."""
    blurred = {
        name for fit in fits for c in (*fit.unidentifiable, *fit.weakly_observable) for name in c.names
    }
    found = [
        {
            p.name: (p.unit, value, std)
            for p, value, std in zip(fit.parameters, fit.x.tolist(), fit.std.tolist(), strict=True)
            if p.is_geometry
        }
        for fit in fits
    ]
    names = [n for n in found[0] if n not in blurred and all(n in other for other in found)]
    return tuple(
        Move(n, found[0][n][0], tuple(f[n][1] for f in found), tuple(f[n][2] for f in found)) for n in names
    )


def _short(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "–"

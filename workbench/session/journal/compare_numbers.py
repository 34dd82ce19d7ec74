"""Replay with comparison of the recorded numbers with the recomputed ones.

The same machine comes to the same digits. Another processor rounds sums in another order, so that numbers
are the same up to `ROUNDING`; what differs by more is a difference.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from workbench.base.progress import progress
from workbench.report.json import document
from workbench.report.result_fields import ResultFields
from workbench.session.journal.numbers import numbers_of
from workbench.session.journal.reader import Recording
from workbench.session.journal.replay import steps
from workbench.session.state import Session

ROUNDING = 1e-9
"""Difference of two numbers, relative to the larger of them and 1, that rounding explains."""
SENTENCES = {"notes", "warnings", "message", "reason", "sentence", "words", "next_reasons"}
"""Texts that another version may word differently."""
RETIRED = {f"{of}.{part}" for of in ("score", "best") for part in ("position", "rotation")} | {
    "identification.noise"
}
"""What earlier versions wrote and this one knows better: errors predicted for any orientation, their
mean; not the noise but the default weights, where rows state their own."""


@dataclass(frozen=True)
class Difference:
    """A value then and now.

    Args:
        step: After which command; 0 is the beginning.
        name: Which, such as `targets.3.q.2`.
        then: As it was written.
        now: As it comes out.
    """

    step: int
    name: str
    then: Any
    now: Any

    @property
    def size(self) -> float:
        """Difference of two numbers relative to the larger of them and 1; 0 or infinite for anything else."""
        if self.then == self.now:
            return 0.0
        if _is_number(self.then) and _is_number(self.now):
            return abs(self.then - self.now) / max(1.0, abs(self.then), abs(self.now))
        return float("inf")


@dataclass(frozen=True, eq=False)
class Replayed:
    """The result of a replay.

    Args:
        session: After the last command.
        steps: Commands that were done again.
        compared: How many values were compared.
        differences: Those that differ by more than rounding.
        rounding: Maximum difference that rounding explains; 0 where all digits are the same.
    """

    session: Session
    steps: int
    compared: int
    differences: tuple[Difference, ...]
    rounding: float

    @property
    def largest(self) -> Difference | None:
        return max(self.differences, key=lambda d: d.size, default=None)

    @property
    def text(self) -> str:
        worst = self.largest
        if worst is None:
            same = "all the same"
            return f"{same} to the last digit" if self.rounding == 0.0 else f"{same} to {self.rounding:.0e}"
        return (
            f"{len(self.differences)} values differ; the largest difference is {worst.name} "
            f"after step {worst.step}: {worst.then} then, {worst.now} now"
        )

    def json(self) -> dict[str, Any]:
        return document(
            "workbench.replay/1",
            steps=self.steps,
            compared=self.compared,
            exact=not self.differences and self.rounding == 0.0,
            rounding=self.rounding,
            differences=ResultFields("step", "name", "then", "now").each(self.differences),
        )


def check(recording: Recording) -> Replayed:
    """Replay all commands and compare every number of the journal."""
    session, written = recording.first, recording.header.get("numbers", {})
    compared, unequal = 0, list[Difference]()

    def note(pairs: Iterator[Difference]) -> None:
        nonlocal compared
        for pair in pairs:
            compared += 1
            if pair.then != pair.now:  # the others are a million values in a long recording
                unequal.append(pair)

    note(compare(written, numbers_of(session, written)))
    sessions = steps(recording.first, recording.entries)
    for step, (line, session) in enumerate(zip(recording.lines, sessions, strict=True), start=1):
        note(compare(line.numbers, numbers_of(session, line.numbers), step=step))
        progress(step / len(recording.lines), line.title)
    return Replayed(
        session=session,
        steps=len(recording.lines),
        compared=compared,
        differences=tuple(pair for pair in unequal if pair.size > ROUNDING),
        rounding=max((pair.size for pair in unequal if pair.size <= ROUNDING), default=0.0),
    )


def compare(then: Any, now: Any, *, step: int = 0, name: str = "") -> Iterator[Difference]:
    """Pairs of values by name; keys missing from the first are ignored."""
    if isinstance(then, dict) and isinstance(now, dict):
        for key, value in then.items():
            path = f"{name}.{key}" if name else key
            if key not in SENTENCES and path not in RETIRED:
                yield from compare(value, now.get(key), step=step, name=path)
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for i, (a, b) in enumerate(zip(then, now, strict=True), start=1):
            yield from compare(a, b, step=step, name=f"{name}.{i}")
    else:
        yield Difference(step, name, then, now)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)

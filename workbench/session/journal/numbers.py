"""The few numbers of a session that the journal stores: robot, score of the targets, fits, diagnosis.

They are compared when a recording is opened again (`compare`). Parts of the session that a command did not
touch stay the same objects, so only what changed is written.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from workbench.diagnosis.result import Diagnosis
from workbench.identification.report.results_json import validation_json
from workbench.identification.result import Identification
from workbench.report.json import Json, plain
from workbench.session.state import Session
from workbench.session.target_state import Score

ROUNDING = 1e-9
"""Difference of two numbers, relative to the larger of them and 1, that rounding explains: another processor
sums in another order."""


def first_targets(session: Session) -> Json:
    """Targets and how the arm stands there: a journal begins with them, so that its replay begins so too."""
    pairs = enumerate(zip(session.plate.targets, session.states, strict=True), start=1)
    return plain({str(i): {"xyz": t.xyz, "rpy": t.rpy} | vars(state) for i, (t, state) in pairs})


def _score(score: Score) -> Json:
    errors = {"position_rms": score.position, "rotation_rms": score.rotation}
    return {"reached": score.measurable, "rank": score.rank} | errors


def _identification(found: Identification | None) -> Json | None:
    if found is None:
        return None
    runs = {name: validation_json(run) for name, run in found.runs.items()}
    return {"nominal": validation_json(found.nominal), "algorithms": runs}


def _diagnosis(found: Diagnosis | None) -> Json | None:
    if found is None:
        return None
    effects = [
        {"name": str(a.effect.name), "joints": [j + 1 for j in a.effect.joints]} for a in found.effects
    ]
    errors = {"before": validation_json(found.before), "after": validation_json(found.after)}
    return {"effects": effects, "verdict": found.verdict} | errors


_SUBJECTS: dict[str, tuple[Callable[[Session], Any], Callable[[Any], Any]]] = {
    "robot": (lambda s: s.robot, lambda robot: robot.name),
    "score": (lambda s: s.score, _score),
    "identification": (lambda s: s.results.identification, _identification),
    "diagnosis": (lambda s: s.results.diagnosis, _diagnosis),
}
"""Of every subject its part of the session, and what is written of it."""


def changed_numbers(session: Session, before: Session | None) -> Json:
    """What is new since an earlier snapshot; everything if there is none."""
    return {
        name: plain(write(part(session)))
        for name, (part, write) in _SUBJECTS.items()
        if before is None or part(session) is not part(before)
    }


@dataclass(frozen=True)
class Difference:
    """A value then and now.

    Args:
        step: Command that it was last written after; 0 is the beginning.
        name: Which, such as `score.position_rms`.
        then: As it was written.
        now: As it comes out.
    """

    step: int
    name: str
    then: Any
    now: Any

    @property
    def size(self) -> float:
        """Of two numbers relative to the larger of them and 1; infinite for anything else."""
        if self.then == self.now:
            return 0.0
        try:
            return abs(self.then - self.now) / max(1.0, abs(self.then), abs(self.now))
        except (TypeError, OverflowError):  # no numbers, or none of a result
            return math.inf


def compare(then: Any, now: Any, *, step: int = 0, name: str = "") -> Iterator[Difference]:
    """All pairs of values by name; what only one side has (another version wrote it) is passed over."""
    if isinstance(then, dict) and isinstance(now, dict):
        for key in then.keys() & now.keys():
            yield from compare(then[key], now[key], step=step, name=f"{name}.{key}".lstrip("."))
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for i, (a, b) in enumerate(zip(then, now, strict=True), start=1):
            yield from compare(a, b, step=step, name=f"{name}.{i}")
    else:
        yield Difference(step, name, then, now)

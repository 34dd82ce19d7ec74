"""The few numbers of a session that the journal stores: robot, targets and their score, fits, diagnosis.

They are compared when a recording is opened again (`compare`). Parts of the session that a command did not
touch stay the same objects, so only what changed is written.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from workbench.identification.report.results_json import validation_json
from workbench.plate.plate import Plate
from workbench.report.json import Json, plain
from workbench.session.state import Session
from workbench.session.target_postures import TargetState

ROUNDING = 1e-9
"""Difference of two numbers, relative to the larger of them and 1, that rounding explains: another processor
sums in another order."""


def _targets(plate: Plate, states: tuple[TargetState, ...]) -> Json:
    pairs = enumerate(zip(plate.targets, states, strict=True), start=1)
    return {str(i): {"xyz": target.xyz, "rpy": target.rpy} | vars(state) for i, (target, state) in pairs}


_SUBJECTS: dict[str, tuple[Callable[[Session], tuple], Callable[..., Any]]] = {
    "robot": (lambda s: (s.robot,), lambda robot: robot.name),
    "targets": (lambda s: (s.plate, s.states), _targets),
    "score": (
        lambda s: (s.score,),
        lambda score: {
            "reached": score.measurable,
            "rank": score.rank,
            "position_rms": score.position,
            "rotation_rms": score.rotation,
        },
    ),
    "identification": (
        lambda s: (s.results.identification,),
        lambda found: {
            "nominal_arm": validation_json(found.nominal),
            "algorithms": {name: validation_json(run) for name, run in found.runs.items()},
        },
    ),
    "diagnosis": (
        lambda s: (s.results.diagnosis,),
        lambda said: {
            "before": validation_json(said.before),
            "effects": [
                {"name": str(a.effect.name), "joints": [j + 1 for j in a.effect.joints]} for a in said.effects
            ],
            "after": validation_json(said.after),
            "verdict": said.verdict,
        },
    ),
}
"""Of every subject the parts of the session that it depends on, and what is written of them."""


def changed_numbers(session: Session, before: Session | None) -> Json:
    """What is new since an earlier snapshot; everything if there is none."""
    if before is None:
        return numbers_of(session, _SUBJECTS)
    both = ((name, zip(parts(session), parts(before), strict=True)) for name, (parts, _) in _SUBJECTS.items())
    changed = [name for name, pairs in both if any(a is not b for a, b in pairs)]
    found = numbers_of(session, changed)
    if "targets" in found and len(before.states) == len(session.states):
        kept = zip(session.plate.targets, before.plate.targets, session.states, before.states, strict=True)
        same = {str(i) for i, (a, b, c, d) in enumerate(kept, start=1) if a is b and c is d}
        found["targets"] = {name: found["targets"][name] for name in found["targets"] if name not in same}
    return found


def numbers_of(session: Session, names: Iterable[str]) -> Json:
    """All numbers about these subjects; earlier versions wrote more of them."""
    known = ((name, _SUBJECTS[name]) for name in names if name in _SUBJECTS)
    each = ((name, write, parts(session)) for name, (parts, write) in known)
    return {name: None if own[0] is None else plain(write(*own)) for name, write, own in each}


@dataclass(frozen=True)
class Difference:
    """A value then and now.

    Args:
        step: After which command; 0 is the beginning.
        name: Which, such as `targets.3.q.2`.
        then: As it was written.
        now: As it comes out.
        size: Of two numbers relative to the larger of them and 1; infinite for anything else.
    """

    step: int
    name: str
    then: Any
    now: Any
    size: float

    @property
    def text(self) -> str:
        values = (f"{v:.4g}" if isinstance(v, float) else str(v)[:40] for v in (self.then, self.now))
        return f"{self.name} {' → '.join(values)}"


def compare(then: Any, now: Any, *, step: int = 0, name: str = "") -> Iterator[Difference]:
    """All pairs of values by name; what only one side has (another version wrote it) is passed over."""
    if isinstance(then, dict) and isinstance(now, dict):
        for key in then.keys() & now.keys():
            yield from compare(then[key], now[key], step=step, name=f"{name}.{key}".lstrip("."))
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for i, (a, b) in enumerate(zip(then, now, strict=True), start=1):
            yield from compare(a, b, step=step, name=f"{name}.{i}")
    else:
        yield Difference(step, name, then, now, _size(then, now))


def _size(then: Any, now: Any) -> float:
    if then == now:
        return 0.0
    try:
        return abs(then - now) / max(1.0, abs(then), abs(now))
    except (TypeError, OverflowError):  # no numbers, or none of a result
        return math.inf

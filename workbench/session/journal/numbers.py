"""The numbers of a session that a journal keeps with every command, and that a replay must come to again.

Each subject says which parts of the session it depends on. Parts that a command did not touch stay the same
objects, so only what changed is written. A new subject is one more entry of `SUBJECTS`.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.identification.report.results_json import identification_json
from workbench.report.json import plain
from workbench.session.state import Session

Json = dict[str, Any]


@dataclass(frozen=True)
class Subject:
    """What a journal says about one thing.

    Args:
        parts: What it depends on.
        numbers: What is written.
    """

    parts: Callable[[Session], tuple]
    numbers: Callable[[Session], Any]


def changed_numbers(session: Session, before: Session | None) -> Json:
    """What is new since an earlier snapshot; everything if there is none."""
    found = {}
    for name, subject in SUBJECTS.items():
        now = subject.parts(session)
        if before is None or any(a is not b for a, b in zip(now, subject.parts(before), strict=True)):
            found[name] = subject.numbers(session)
    if before is not None and "targets" in found:
        found["targets"] = _moved(session, before)
    return plain(found)


def numbers_of(session: Session, names: Collection[str]) -> Json:
    """All numbers about these subjects."""
    return plain({name: SUBJECTS[name].numbers(session) for name in names if name in SUBJECTS})


def _targets(session: Session) -> Json:
    pairs = enumerate(zip(session.plate.targets, session.states, strict=True), start=1)
    return {str(i): {"xyz": target.xyz, "rpy": target.rpy} | vars(state) for i, (target, state) in pairs}


def _moved(session: Session, before: Session) -> Json:
    """Targets that differ; all of them if there are more or fewer than before."""
    every = _targets(session)
    if len(before.states) != len(session.states):
        return every
    same = (
        session.plate.targets[i] is before.plate.targets[i] and session.states[i] is before.states[i]
        for i in range(len(session.states))
    )
    return {name: every[name] for name, kept in zip(every, same, strict=True) if not kept}


def _region(session: Session) -> Json:
    region = session.plate.region
    return {"min": region.min, "max": region.max, "cube": region.cube}


def _score(session: Session) -> Json:
    score = session.score
    return {
        "indices": score.indices,
        "per_target": score.per_target,
        "reached": score.measurable,
        "rank": score.rank,
        "condition": score.condition,
        "position_rms": score.position,
        "rotation_rms": score.rotation,
    }


def _data(session: Session) -> Json | None:
    if session.loaded is None:
        return None
    rows, checks = session.loaded.dataset, session.loaded.checks
    found: Json = {"name": session.loaded.name, "rows": len(rows), "q_mean": rows.q.mean(0)}
    if rows.position is not None:
        found["position_mean"] = np.nanmean(rows.position, 0)
    return found | {"checks": 0 if checks is None else len(checks)}


def _identification(session: Session) -> Json | None:
    """As `identify --json`, without what depends on the machine."""
    if session.identification is None:
        return None
    found = identification_json(session.identification)
    del found["prior"]
    found["typical_noise"] = found.pop("noise")
    for run in found["algorithms"].values():
        del run["seconds"]
    return found


def _diagnosis(session: Session) -> Json | None:
    """As `diagnose --json`, without what depends on the machine."""
    if session.diagnosis is None:
        return None
    found = diagnosis_json(session.diagnosis)
    del found["seconds"]
    return found


def _accepted(session: Session) -> Json:
    """Coefficients by the effect's own names, SI."""
    return {
        str(i): dict(zip(effect.names, effect.coefficients, strict=True)) | {"effect": str(effect.name)}
        for i, effect in enumerate(session.accepted, start=1)
    }


def _best(session: Session) -> Json | None:
    score = session.best_score
    return None if score is None else {"position_rms": score.position, "rotation_rms": score.rotation}


def _comparison(session: Session) -> Json | None:
    rows = session.comparison
    if rows is None:
        return None
    return {"rows": len(rows), "nominal": rows.errors[:, 0], "calibrated": rows.errors[:, 1]}


def _rows_taken(session: Session) -> Json | None:
    if session.measuring is None:
        return None
    capture = session.measuring.acquisition.capture
    return {"target": capture.target.name, "rows": len(capture.targets) - capture.remaining}


def _yield(session: Session) -> Json | None:
    if session.trial is None:
        return None
    found = session.trial.found
    return {"arms": found.arms, "share": found.share, "position": found.position.mean()}


def _track(session: Session) -> Json | None:
    track = session.track
    if track is None:
        return None
    return {
        "kind": track.kind,
        "rows": len(track.q),
        "q_mean": track.q.mean(0),
        "errors": track.errors.mean(),
    }


def _shown(session: Session) -> Json:
    return {"selected": session.selected, "focus": str(session.focus), "row": session.row}


SUBJECTS = {
    "robot": Subject(lambda s: (s.robot,), lambda s: s.robot.name),
    "region": Subject(lambda s: (s.plate.region,), _region),
    "targets": Subject(lambda s: (s.plate, s.states), _targets),
    "score": Subject(lambda s: (s.score,), _score),
    "noise": Subject(
        lambda s: (s.noise,), lambda s: {"position": s.noise.position, "rotation": s.noise.rotation}
    ),
    "data": Subject(lambda s: (s.loaded,), _data),
    "measuring": Subject(
        lambda s: (None if s.measuring is None else s.measuring.acquisition.capture,), _rows_taken
    ),
    "identification": Subject(lambda s: (s.identification,), _identification),
    "diagnosis": Subject(lambda s: (s.diagnosis,), _diagnosis),
    "rezero": Subject(lambda s: (s.rezero,), lambda s: None if s.rezero is None else s.rezero.json()),
    "accepted": Subject(lambda s: (s.accepted,), _accepted),
    "best": Subject(lambda s: (s.best_score,), _best),
    "fit": Subject(lambda s: (s.fit,), lambda s: s.fit),
    "comparison": Subject(lambda s: (s.comparison,), _comparison),
    "yield": Subject(lambda s: (s.trial,), _yield),
    "track": Subject(lambda s: (s.track,), _track),
    "shown": Subject(lambda s: (s.selected, s.focus, s.row), _shown),
}
"""What a journal says, by subject."""

"""The numbers of a session that the journal stores with every command and a replay must reproduce.

Each subject says which parts of the session it depends on. Parts that a command did not touch stay the same
objects, so only what changed is written. A new subject is one more entry of `SUBJECTS`, or stands in another
package's record of parts.
"""

import json
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.data.readers.layouts import PLAIN
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.diagnosis.result import Diagnosis
from workbench.identification.report.results_json import identification_json
from workbench.identification.result import Identification
from workbench.parts import PartTable, warn_of_broken
from workbench.plate.plate import Plate
from workbench.report.json import Json, plain
from workbench.session.live_score import PlateTrial
from workbench.session.loaded_measurements import Loaded
from workbench.session.played_motion import Played
from workbench.session.state import Session
from workbench.session.target_state import Score, TargetState


@dataclass(frozen=True)
class Subject:
    """What a journal says about one thing.

    Args:
        name: What the journal calls it.
        parts: What it depends on.
        numbers: What is written of these parts; nothing while the first is None.
    """

    name: str
    parts: Callable[[Session], tuple]
    numbers: Callable[..., Any]

    def of(self, session: Session) -> Any:
        parts = self.parts(session)
        return None if parts[0] is None else self.numbers(*parts)

    def plain(self, session: Session) -> Any:
        """The same as a journal holds it; of another package's only what JSON can hold."""
        found = plain(self.of(session))
        if not self.numbers.__module__.startswith("workbench."):
            json.dumps(found)
        return found

    def differs(self, session: Session, before: Session) -> bool:
        """Whether anything that it depends on is another than in an earlier session."""
        return any(a is not b for a, b in zip(self.parts(session), self.parts(before), strict=True))


def changed_numbers(session: Session, before: Session | None) -> Json:
    """What is new since an earlier snapshot; everything if there is none."""
    found = {}
    for name, subject in SUBJECTS.items():
        with _guarded(subject) as is_sound:
            if is_sound and (before is None or subject.differs(session, before)):
                found[name] = subject.plain(session)
    if before is not None and "targets" in found:
        found["targets"] = plain(_moved(session, before))
    return found


def numbers_of(session: Session, names: Collection[str]) -> Json:
    """All numbers about these subjects."""
    found = {}
    for name in names:
        if (subject := SUBJECTS.get(name)) is not None:
            with _guarded(subject) as is_sound:
                if is_sound:
                    found[name] = subject.plain(session)
    return found


_BROKEN: set[Subject] = set()
"""Subjects of other packages that raised: they are no longer asked."""


@contextmanager
def _guarded(subject: Subject) -> Iterator[bool]:
    """Whether a subject is sound: one that raises, or that says what no journal can hold, is no longer asked,
    and a warning names it."""
    try:
        yield subject not in _BROKEN
    except Exception as error:  # whatever is wrong with somebody else's package
        _BROKEN.add(subject)
        warn_of_broken(f"the journal number {subject.name}", error)


def _targets(plate: Plate, states: tuple[TargetState, ...]) -> Json:
    pairs = enumerate(zip(plate.targets, states, strict=True), start=1)
    return {str(i): {"xyz": target.xyz, "rpy": target.rpy} | vars(state) for i, (target, state) in pairs}


def _moved(session: Session, before: Session) -> Json:
    """Targets that differ; all of them if there are more or fewer than before."""
    every = _targets(session.plate, session.states)
    if len(before.states) != len(session.states):
        return every
    same = (
        session.plate.targets[i] is before.plate.targets[i] and session.states[i] is before.states[i]
        for i in range(len(session.states))
    )
    return {name: every[name] for name, kept in zip(every, same, strict=True) if not kept}


def _score(score: Score) -> Json:
    return {
        "indices": score.indices,
        "per_target": score.per_target,
        "reached": score.measurable,
        "rank": score.rank,
        "condition": score.condition,
        "position_rms": score.position,
        "rotation_rms": score.rotation,
    }


def _data(loaded: Loaded) -> Json:
    rows, checks = loaded.dataset, loaded.checks
    found: Json = {"name": loaded.name, "rows": len(rows), "q_mean": rows.q.mean(0)}
    if rows.position is not None and np.isfinite(rows.position).any():
        found["position_mean"] = np.nanmean(rows.position, 0)
    if loaded.file is not None and loaded.file.preview.layout != PLAIN:
        found["layout"] = loaded.file.preview.layout
    return found | {"checks": 0 if checks is None else len(checks)}


def _identification(identification: Identification) -> Json:
    """As `identify --json`, without what depends on the machine."""
    found = identification_json(identification)
    del found["prior"]
    found["typical_noise"] = found.pop("noise")
    for run in found["algorithms"].values():
        del run["seconds"]
    return found


def _diagnosis(diagnosis: Diagnosis) -> Json:
    """As `diagnose --json`, without what depends on the machine."""
    found = diagnosis_json(diagnosis)
    del found["seconds"]
    return found


def _accepted(effects: tuple[AbstractEffect, ...]) -> Json:
    """Coefficients by the effect's own names, SI."""
    return {
        str(i): dict(zip(effect.names, effect.coefficients, strict=True)) | {"effect": str(effect.name)}
        for i, effect in enumerate(effects, start=1)
    }


SUBJECTS: PartTable[Subject] = PartTable(
    "journal_numbers",
    Subject,
    Subject("robot", lambda s: (s.robot,), lambda robot: robot.name),
    Subject("region", lambda s: (s.plate.region,), lambda r: {"min": r.min, "max": r.max, "cube": r.cube}),
    Subject("targets", lambda s: (s.plate, s.states), _targets),
    Subject("score", lambda s: (s.score,), _score),
    Subject("noise", lambda s: (s.noise,), lambda n: {"position": n.position, "rotation": n.rotation}),
    Subject("data", lambda s: (s.measurements.loaded,), _data),
    Subject("identification", lambda s: (s.results.identification,), _identification),
    Subject("diagnosis", lambda s: (s.results.diagnosis,), _diagnosis),
    Subject("accepted", lambda s: (s.results.accepted,), _accepted),
    Subject(
        "best",
        lambda s: (s.history.best_score,),
        lambda b: {"position_rms": b.position, "rotation_rms": b.rotation},
    ),
    Subject("fit", lambda s: (s.results.fit,), lambda fit: fit),
    Subject(
        "comparison",
        lambda s: (s.results.comparison,),
        lambda c: {"rows": len(c), "nominal": c.errors[:, 0], "calibrated": c.errors[:, 1]},
    ),
    Subject(
        "yield",
        lambda s: (s.part(PlateTrial),),
        lambda trial: {"arms": trial.arms, "share": trial.share, "position": trial.position},
    ),
    Subject("track", lambda s: ((p := s.part(Played)) and p.motion,), lambda motion: motion.numbers()),
    Subject(
        "shown",
        lambda s: (s.selected, s.playback.focus, s.results.row),
        lambda selected, focus, row: {"selected": selected, "focus": str(focus), "row": row},
    ),
)
"""What a journal says, by subject."""

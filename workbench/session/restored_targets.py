"""Targets and scores restored exactly from a journal, without recomputing them.

A recalled score lacks what is shown of the present one alone: `completed` adds that at the end.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from workbench.base.types import frozen
from workbench.session.state import Session, UndoStep
from workbench.session.target_state import Score, TargetState
from workbench.session.target_steps import score_of, with_branches


def recall_targets(session: Session, numbers: Mapping[str, Any]) -> Session:
    """The session with the states of its targets, and its score, as they were written.

    A score of an earlier version, whose predicted error meant something else, is worked out anew.
    """
    states = list(session.states)
    for name, state in numbers.get("targets", {}).items():
        states[int(name) - 1] = recalled_state(state)
    session, written = replace(session, states=tuple(states)), numbers.get("score")
    if written is None:
        return session
    known = "position_rms" in written
    now = _score(written, session) if known else score_of(session, UndoStep(session.plate, session.states))
    return replace(session, score=now)


def with_full_scores(session: Session) -> Session:
    """The session with all that is shown of its present score, and the branches of its target."""
    now, best = session.score, session.history.best_score
    if now.linearisation is None:
        now = score_of(session, UndoStep(session.plate, session.states))
    if best is session.score:
        best = now
    elif best is not None and best.linearisation is None and session.history.best is not None:
        best = score_of(session, session.history.best)
    return with_branches(replace(session, score=now, history=replace(session.history, best_score=best)))


def recalled_state(numbers: Mapping[str, Any]) -> TargetState:
    """How the arm stood at a target."""
    known = {key: value for key, value in numbers.items() if key not in ("xyz", "rpy", "q", "missing")}
    position, rotation = numbers["missing"]
    return TargetState(q=frozen(np.array(numbers["q"])), missing=(position, rotation), **known)


def _score(numbers: Mapping[str, Any], session: Session) -> Score:
    """A score by its numbers; what is infinite or unknown was written as null."""
    unbounded = math.inf if len(session.region.q) or not numbers["reached"] else math.nan
    position, rotation = (
        unbounded if numbers[part] is None else numbers[part] for part in ("position_rms", "rotation_rms")
    )
    return Score(
        per_target=frozen(np.array(numbers["per_target"], float)),
        indices={name: math.inf if v is None else v for name, v in numbers["indices"].items()},
        measurable=numbers["reached"],
        rank=numbers["rank"],
        parameters=session.score.parameters,
        condition=math.inf if numbers["condition"] is None else numbers["condition"],
        position=position,
        rotation=rotation,
        rises=frozen(np.full(len(numbers["per_target"]), np.nan)),
    )

"""The command that makes the rows after an event a session of their own."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from workbench.arm.effects.events import FrameStep, ToolStep
from workbench.base.errors import DataError, WorkbenchError
from workbench.base.types import Freedom
from workbench.base.wording import ranges
from workbench.data.measuring_order import split_sessions
from workbench.diagnosis.event_notes import UNDECIDED
from workbench.diagnosis.result import Diagnosis
from workbench.session.command import AbstractChange, computed
from workbench.session.commands.data import measurements, with_data
from workbench.session.loaded_measurements import Loaded
from workbench.session.page_state import Severity
from workbench.session.state import Session
from workbench.session.target_steps import begin_step

SPLIT = "Start a new session there"


class MakeSession(AbstractChange):
    """Make the rows from one on, as they were measured, a session with base and tool of their own.

    Args:
        row: Number of the first of them, counted from 0.
    """

    row: int

    title = computed(lambda self: f"Start a new session at row {self.row}")

    def check(self, session: Session) -> None:
        split(measurements(session), self.row)
        for event in () if session.results.diagnosis is None else session.results.diagnosis.events:
            what = {FrameStep: "base", ToolStep: "tool"}.get(type(event))
            if event.row == self.row and what and getattr(session.robot, what).free is Freedom.FIXED:
                raise DataError(
                    f"the robot's file fixes the {what}, so it can't differ between sessions; "
                    f"set free = true under [{what}] there"
                )

    def apply(self, session: Session) -> Session:
        loaded, found = split(measurements(session), self.row), session.results.diagnosis
        undecided = [row for row, why in (() if found is None else found.excluded) if why == UNDECIDED]
        after = with_data(begin_step(session, session), loaded)
        left_out = session.measurements.left_out.union(undecided)
        after = replace(after, measurements=replace(session.measurements, loaded=loaded, left_out=left_out))
        text = f"the rows from row {self.row} on are now a separate session; diagnose again"
        if undecided:
            text += f" (held-out rows that can't be assigned to either are excluded: {ranges(undecided)})"
        return after.with_message(Severity.INFO, text)


def new_frames(found: Diagnosis) -> dict[int, str]:
    """First row after each step of base or tool that is named, and the sentence on it."""
    steps = ((c.event, c.sentence) for c in found.causes)
    sentences = {event.row: text for event, text in steps if isinstance(event, FrameStep | ToolStep)}
    return dict(sorted(sentences.items()))


def splittable(session: Session) -> dict[int, str]:
    """Steps of base or tool, found in the present rows, which share a session with rows before them."""
    if session.results.diagnosis is None or session.measurements.loaded is None:
        return {}
    taken = {}
    for row, text in new_frames(session.results.diagnosis).items():
        with suppress(WorkbenchError):
            MakeSession(row).check(session)
            taken[row] = text
    return taken


def split(loaded: Loaded, row: int) -> Loaded:
    """Measurements with the rows from one on in sessions of their own; checking rows are of the last one."""
    data = split_sessions(loaded.dataset, row)
    assert data.session is not None
    last, checks = str(data.session[data.row == row][-1]), loaded.checks
    facts = [fact for fact in loaded.facts if fact[0] != "Sessions"]
    return replace(
        loaded,
        dataset=data,
        facts=(*facts, ("Sessions", ", ".join(data.sessions))),
        notes=(*loaded.notes, data.notes[-1]),
        read=None if loaded.read is None else replace(loaded.read, session=data.session, notes=data.notes),
        checks=None if checks is None else replace(checks, session=np.full(len(checks), last)),
    )

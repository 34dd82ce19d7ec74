"""Commands that restore earlier states: undo, redo, the plate as loaded, the best plate so far."""

from dataclasses import replace

from workbench.base.errors import OptionError
from workbench.session.command import AbstractChange, computed
from workbench.session.state import Group, Session, Severity, UndoStep
from workbench.session.target_steps import (
    AbstractTargetStep,
    begin_step,
    check_free,
    commit_step,
    first_difference,
    with_targets,
)


class Undo(AbstractTargetStep):
    """Take the last step back."""

    title = "Undo"

    def apply(self, session: Session) -> Session:
        if not session.done:
            return session.tell(Severity.INFO, "nothing to undo")
        step = session.done[-1]
        if step.session is not None:
            whole = replace(step.session, undone=(UndoStep(session.plate, session.states, session),))
            return _restored(session, whole)
        undone = (*session.undone, UndoStep(session.plate, session.states))
        return go_to_step(replace(session, done=session.done[:-1], undone=undone), step)


class Redo(AbstractTargetStep):
    """Make the last undone step again."""

    title = "Redo"

    def apply(self, session: Session) -> Session:
        if not session.undone:
            return session.tell(Severity.INFO, "nothing to redo")
        step = session.undone[-1]
        if step.session is not None:
            return _restored(session, step.session)
        done = (*session.done, UndoStep(session.plate, session.states))
        return go_to_step(replace(session, undone=session.undone[:-1], done=done), step)


class ResetTargets(AbstractTargetStep):
    """Restore the plate as loaded; can be undone."""

    title = "Reset the targets"

    def apply(self, session: Session) -> Session:
        first = session.first_plate
        if session.plate is first:
            return session.tell(Severity.INFO, f"the targets are already as in '{first.name}'")
        return go_to_step(begin_step(session), UndoStep(first, session.first_states))


class RestoreBest(AbstractTargetStep):
    """Restore the best plate so far; can be undone."""

    title = "Back to the best plate so far"

    def apply(self, session: Session) -> Session:
        if session.best is None or session.best.plate is session.plate:
            return session.tell(Severity.INFO, "this is the best plate so far")
        return go_to_step(begin_step(session), session.best)


class GoBackTo(AbstractChange):
    """Restore the plate as it was after a step of the history; can be undone.

    Args:
        step: Which, counted from 0.
    """

    step: int

    title = computed(lambda self: f"Back to the plate after step {self.step + 1}")

    def check(self, session: Session) -> None:
        check_free(session)
        if not 0 <= self.step < len(session.past):
            raise OptionError(f"step must be 1 to {len(session.past)}, got {self.step + 1}")

    def apply(self, session: Session) -> Session:
        step = session.past[self.step]
        if step.plate is session.plate:
            return session.tell(Severity.INFO, "the plate is as it was then")
        return go_to_step(begin_step(session), step)


def _restored(now: Session, whole: Session) -> Session:
    """Another robot with all that was measured and found, in the present page."""
    session = replace(
        whole.taking(now, Group.PAGE),
        messages=now.messages,
        chore=now.chore,
        source=now.source,
        opened=now.opened,
    )
    loaded = "" if whole.loaded is None else f", {whole.loaded.name} with what was found from it"
    return session.tell(Severity.INFO, f"back on {whole.robot.name}, plate '{whole.plate.name}'{loaded}")


def go_to_step(session: Session, step: UndoStep) -> Session:
    """The session with the targets of a step, the first one that differs selected."""
    return commit_step(
        with_targets(session, step.plate, step.states, selected=first_difference(session.plate, step.plate))
    )

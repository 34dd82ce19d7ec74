"""Commands that restore earlier states: undo, redo, the plate as loaded, the best plate so far."""

from dataclasses import replace

from workbench.session.page_state import Severity
from workbench.session.part import GoesWith
from workbench.session.state import Session, UndoStep
from workbench.session.target_steps import AbstractTargetStep, begin_step, finish_step


class Undo(AbstractTargetStep):
    """Take the last step back."""

    title = "Undo"

    def apply(self, session: Session) -> Session:
        return _turned(session, "done", "undone")


class Redo(AbstractTargetStep):
    """Make the last undone step again."""

    title = "Redo"

    def apply(self, session: Session) -> Session:
        return _turned(session, "undone", "done")


class RestoreBest(AbstractTargetStep):
    """Restore the best plate so far; can be undone."""

    title = "Back to the best plate so far"

    def apply(self, session: Session) -> Session:
        best = session.history.best
        if best is None or best.plate is session.plate:
            return session.with_message(Severity.INFO, "this is the best plate so far")
        return go_to_step(begin_step(session), best)


def _turned(session: Session, back: str, on: str) -> Session:
    """The session after the last of the steps in one list, which goes over to the other."""
    if not (steps := getattr(session.history, back)):
        return session.with_message(Severity.INFO, f"nothing to {'undo' if back == 'done' else 'redo'}")
    *left, step = steps
    session = session.with_message(Severity.LOG, f"{step.by[:1].lower()}{step.by[1:]}")
    now = replace(UndoStep.of(session, is_whole=step.session is not None), by=step.by)
    lists = {back: tuple(left), on: (*getattr(session.history, on), now)}
    if (whole := step.session) is None:
        return go_to_step(session.updated("history", **lists), step)
    of_whole = whole.with_parts(GoesWith.PLATE, GoesWith.MEASUREMENTS).parts
    parts = {**of_whole, **session.with_parts(GoesWith.PAGE).parts}
    return replace(whole, page=session.page, parts=parts).updated("history", **lists)


def go_to_step(session: Session, step: UndoStep) -> Session:
    """The session with the targets of a step, the first one that differs selected."""
    pairs = enumerate(zip(session.plate.targets, step.plate.targets, strict=False))
    other = next((i for i, (now, then) in pairs if now is not then), session.selected)
    return finish_step(replace(session, selected=other), step.plate, step.states)

"""Commands that restore earlier states: undo, redo, the plate as loaded, the best plate so far."""

from dataclasses import replace

from workbench.session.page_state import Severity
from workbench.session.part import GoesWith
from workbench.session.state import Session, UndoStep
from workbench.session.target_steps import AbstractTargetStep, begin_step, commit_step, with_targets


class Undo(AbstractTargetStep):
    """Take the last step back."""

    title = "Undo"

    def apply(self, session: Session) -> Session:
        if not session.history.done:
            return session.with_message(Severity.INFO, "nothing to undo")
        *done, step = session.history.done
        now = UndoStep.of(session)
        if step.session is not None:
            return _restored(session, step.session, (replace(now, session=session),))
        undone = (*session.history.undone, now)
        history = replace(session.history, done=tuple(done), undone=undone)
        return go_to_step(replace(session, history=history), step)


class Redo(AbstractTargetStep):
    """Make the last undone step again."""

    title = "Redo"

    def apply(self, session: Session) -> Session:
        if not session.history.undone:
            return session.with_message(Severity.INFO, "nothing to redo")
        *undone, step = session.history.undone
        if step.session is not None:
            return _restored(session, step.session, step.session.history.undone)
        done = (*session.history.done, UndoStep.of(session))
        history = replace(session.history, undone=tuple(undone), done=done)
        return go_to_step(replace(session, history=history), step)


class RestoreBest(AbstractTargetStep):
    """Restore the best plate so far; can be undone."""

    title = "Back to the best plate so far"

    def apply(self, session: Session) -> Session:
        return _back_to(session, session.history.best, "this is the best plate so far")


def _back_to(session: Session, step: UndoStep | None, already: str) -> Session:
    """The targets of an earlier step, as a new one; a message where they stand so already."""
    if step is None or step.plate is session.plate:
        return session.with_message(Severity.INFO, already)
    return go_to_step(begin_step(session), step)


def _restored(now: Session, whole: Session, undone: tuple[UndoStep, ...]) -> Session:
    """Another robot with all that was measured and found, in the present page."""
    of_whole = whole.with_parts(GoesWith.PLATE, GoesWith.MEASUREMENTS).parts
    parts = {**of_whole, **now.with_parts(GoesWith.PAGE).parts}
    session = replace(whole, page=now.page, parts=parts, history=replace(whole.history, undone=undone))
    loaded = whole.measurements.loaded
    rows = "" if loaded is None else f", {loaded.name} with its results"
    text = f"back to {whole.robot.name}, plate '{whole.plate.name}'{rows}"
    return session.with_message(Severity.INFO, text)


def go_to_step(session: Session, step: UndoStep) -> Session:
    """The session with the targets of a step, the first one that differs selected."""
    pairs = enumerate(zip(session.plate.targets, step.plate.targets, strict=False))
    other = next((i for i, (now, then) in pairs if now is not then), None)
    return commit_step(with_targets(session, step.plate, step.states, selected=other))

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
        return _turned(session, "done", "undone") or session.with_message(Severity.INFO, "nothing to undo")


class Redo(AbstractTargetStep):
    """Make the last undone step again."""

    title = "Redo"

    def apply(self, session: Session) -> Session:
        return _turned(session, "undone", "done") or session.with_message(Severity.INFO, "nothing to redo")


class RestoreBest(AbstractTargetStep):
    """Restore the best plate so far; can be undone."""

    title = "Back to the best plate so far"

    def apply(self, session: Session) -> Session:
        best = session.history.best
        if best is None or best.plate is session.plate:
            return session.with_message(Severity.INFO, "this is the best plate so far")
        return go_to_step(begin_step(session), best)


def _turned(session: Session, back: str, on: str) -> Session | None:
    """The session after the last of the steps in one list, which goes over to the other; None without any."""
    if not (steps := getattr(session.history, back)):
        return None
    *left, step = steps
    if (whole := step.session) is not None:
        undone = (UndoStep.of(session, session),) if back == "done" else whole.history.undone
        return _restored(session, whole, undone)
    lists = {back: tuple(left), on: (*getattr(session.history, on), UndoStep.of(session))}
    return go_to_step(session.updated("history", **lists), step)


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

"""A session's report: one self-contained HTML file with pictures and tables, made from its journal."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.files import write_text
from workbench.base.wording import plural
from workbench.diagnosis.report.ranking import ranking
from workbench.identification.report.constants import corrections
from workbench.identification.report.error_plots import before_after
from workbench.identification.report.table import error_cards
from workbench.identification.result import judged, order_of_measuring
from workbench.report.figures import DrawnFigure, svg
from workbench.report.html import page_template
from workbench.report.numbers import short
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.journal.entry import Ending
from workbench.session.journal.reader import JournalLine, Recording
from workbench.session.journal.restore import Restored
from workbench.session.state import Session
from workbench.session.target_state import Score
from workbench.views.recording.sentences import model_errors, parameter_rows, remarks, with_predicted

DEGREES = float(np.rad2deg(1.0))
PREDICTED = (("predicted error, rms [mm]", 1e3), ("predicted rotation error, rms [°]", DEGREES))


def write_page(recording: Recording, replayed: Restored, path: Path) -> Path:
    """Write the report of a recorded session, the file whole or not at all."""
    first, last = recording.first, replayed.session
    found, run = last.results.identification, last.results.run
    text = page_template("session.html", package="workbench.extras.review").render(
        robot=last.robot.name,
        began=recording.header.get("began", "")[:16].replace("T", " "),
        replayed=replayed,
        cards=[] if found is None or run is None else error_cards(judged(found.nominal), judged(run)),
        notes=[*recording.notes, *(() if found is None else found.warnings)],
        facts=_facts(recording, last),
        scores=list(_scores(first.score, last.score)),
        moved=list(_moved(first, last)),
        diagnosis=last.results.diagnosis,
        model_errors=[] if last.results.diagnosis is None else list(model_errors(last.results.diagnosis)),
        remarks=[] if last.results.diagnosis is None else list(remarks(last.results.diagnosis)),
        drawings=list(_drawings(last)),
        fit="" if run is None else run.fit.title,
        parameters=[] if run is None else list(parameter_rows(run.fit)),
        decisions=list(_decisions(recording)),
    )
    return write_text(path, text)


def _facts(recording: Recording, session: Session) -> list[tuple[str, str]]:
    loaded, branched = session.measurements.loaded, recording.header.get("branched")
    minutes, seconds = divmod(round(recording.seconds), 60)
    facts = [
        ("Recording", recording.folder.name),
        ("Robot", f"{session.robot.name} ({session.robot.convention}, {session.robot.dof} joints)"),
        ("Plate", f"{session.plate.name}, {plural(len(session.plate), 'target')}"),
        ("Steps", f"{len(recording.lines)} in {minutes} min {seconds} s"),
        ("Instrument", f"{1e3 * session.noise.position:.3g} mm, {np.rad2deg(session.noise.rotation):.3g}°"),
        (
            "Measurements",
            "none" if loaded is None else f"{loaded.name}, {plural(len(loaded.dataset), 'row')}",
        ),
    ]
    if branched is not None:
        facts.append(("Branched off", f"from {branched['from']} after step {branched['step']}"))
    return facts


def _scores(first: Score, last: Score) -> Iterator[tuple[str, str, str]]:
    yield "measurable targets", f"{first.measurable}", f"{last.measurable}"
    for (name, scale), part in zip(PREDICTED, ("position", "rotation"), strict=True):
        yield name, short(scale * getattr(first, part)), short(scale * getattr(last, part))
    for name, value in last.indices.items():
        yield f"index {name}", f"{first.indices[name]:.4g}", f"{value:.4g}"


def _moved(first: Session, last: Session) -> Iterator[tuple[str, str, str, str]]:
    for i, (a, b) in enumerate(zip(first.plate.targets, last.plate.targets, strict=False), start=1):
        if not np.array_equal(a.pose, b.pose):
            distance = 1e3 * float(np.linalg.norm(b.xyz - a.xyz))
            yield f"{i}", _place(a.xyz), _place(b.xyz), f"{distance:.1f}"


def _place(xyz: np.ndarray) -> str:
    return ", ".join(f"{1e3 * v:.1f}".replace("-", "−") for v in xyz)


def _drawings(session: Session) -> Iterator[DrawnFigure]:
    found = session.results.identification
    if found is not None:
        rows = before_after(found, order_of_measuring(found))
        yield DrawnFigure("before-after", "Before and after, row by row", "", svg(rows, "before-after"))
        figure = corrections(found.best)
        if figure is not None:
            yield DrawnFigure("corrections", "Corrections to the arm", "", svg(figure, "corrections"))
    figure = None if session.results.diagnosis is None else ranking(session.results.diagnosis)
    if figure is not None:
        yield DrawnFigure("ranking", "Improvement by each effect", "", svg(figure, "ranking"))


def _decisions(recording: Recording) -> Iterator[tuple[int, str, str]]:
    """Steps that are not only passed through, in plain words; a drag is one of them."""
    place = ""
    for step, line in enumerate(recording.lines, start=1):
        entry = line.entry
        if isinstance(entry.command, GrabTarget):
            place = ""
        if isinstance(entry.command, MoveTarget) and entry.ending is Ending.DONE:
            place = _moved_to(entry.command, line.numbers)
        if _is_passed(line):
            continue
        text = line.title if entry.ending is Ending.DONE else f"{line.title} ({entry.ending})"
        text = place if isinstance(entry.command, DropTarget) and place else text
        yield step, f"{entry.at:.1f} s", "; ".join([text, *line.messages])


def _is_passed(line: JournalLine) -> bool:
    """Whether the step can be left out: the start or an intermediate position of a drag."""
    passing = isinstance(line.entry.command, GrabTarget | MoveTarget)
    return passing and line.entry.ending is Ending.DONE and not line.messages


def _moved_to(command: MoveTarget, numbers: dict[str, Any]) -> str:
    text = f"Move target {command.target + 1} to {_place(np.array(command.xyz))} mm"
    state = numbers.get("targets", {}).get(f"{command.target + 1}", {})
    if not state.get("reached", True):
        return f"{text}, out of reach"
    return with_predicted(text, numbers.get("score", {}).get("position_rms"))

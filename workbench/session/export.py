"""Files that a session can export, with their names and contents."""

import csv
import io
import re
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from workbench.arm.built_in_arms import save_robot
from workbench.arm.joint_units import shown_joints, sliding, sliding_numbers
from workbench.arm.robot import Robot
from workbench.arm.robot_toml import robot_text
from workbench.base.errors import DataError
from workbench.data import writer
from workbench.exports import AbstractForm, export
from workbench.identification.result import Identification
from workbench.identification.rows.row_selection import marked
from workbench.plate.plate_toml import plate_text
from workbench.report.blocks import Block
from workbench.session.loaded_measurements import BY_HAND
from workbench.session.state import Session

File = tuple[str, bytes]
"""Its name and contents."""
NotedFile = tuple[str, bytes, tuple[str, ...]]
"""The same, and what to tell with it."""
Make = Callable[..., File | NotedFile]
"""Makes one of a session."""
T = TypeVar("T")


def plate_toml(session: Session) -> File:
    """The plate with its current targets."""
    return f"{stem_of(session.plate.name)}.toml", plate_text(session.plate).encode()


def measurements_csv(session: Session) -> File:
    """The loaded or virtually measured rows; those that the result or the user leaves out are marked."""
    if (loaded := session.measurements.loaded) is None:
        raise DataError("there are no measurements to save; load a file or measure a virtual arm first")
    found, rows = session.results.identification, loaded.dataset
    pairs = (*marked(rows), *(() if found is None else found.excluded))
    out = {row: why for row, why in pairs if why != BY_HAND}
    out |= dict.fromkeys(session.measurements.left_out, BY_HAND)
    if out:
        reason = np.array([out.get(row, "") for row in rows.row.tolist()])
        rows = replace(rows, exclude=np.isin(rows.row, list(out)), reason=reason)
    content = writer.measurements_csv(rows, prismatic=sliding_numbers(session.robot))
    return f"{stem_of(Path(loaded.name).stem)}-in-rad-and-m.csv", content.encode()


def next_poses_csv(session: Session) -> File:
    """Joint positions of the poses to measure next, with what each of them would tell."""
    found = session.results.diagnosis
    if found is None or not len(found.measure_next):
        raise DataError("no diagnosis suggests poses; press Diagnose first")
    reasons = [reason.sentence for reason in found.next_reasons] or [""] * len(found.measure_next)
    content = _poses_csv(session.robot, np.asarray(found.measure_next), tells=reasons)
    return f"{stem_of(session.robot.name)}-next-poses.csv", content


def robot_toml(session: Session) -> File:
    """The session's nominal robot."""
    return f"{stem_of(session.robot.name)}.toml", robot_text(session.robot).encode()


def calibrated_as(ending: str) -> Callable[..., File]:
    """Writes the shown fit's robot as `.toml`, or as `.urdf`: the geometry that is best without effects."""

    def file(session: Session, *, force: bool = False) -> File:
        name = f"{stem_of(session.robot.name)}-calibrated{ending}"
        return name, _written(name, lambda path: save_robot(_calibrated(session), path, force=force))[0]

    return file


calibrated_toml, calibrated_urdf = calibrated_as(".toml"), calibrated_as(".urdf")


def exported_as(form: AbstractForm) -> Callable[..., NotedFile]:
    """Writes the shown fit's arm in a form of `export --for`, with notes on what its file can't hold."""

    def file(session: Session, *, force: bool = False) -> NotedFile:
        name = f"{stem_of(session.robot.name)}-{form.name}{form.ending}"
        arm, own = _calibrated(session), session.robot
        content, done = _written(name, lambda path: export(arm, form.name, path, nominal=own, force=force))
        return name, content, (done.verdict, *done.notes)

    return file


def report_zip(session: Session) -> File:
    """The report of the identification, after the causes that were found, as a folder in a ZIP file."""
    from workbench.diagnosis.report.document import causes, verdict
    from workbench.identification.report.results_json import write_identification

    found, diagnosis = _identified(session), session.results.diagnosis
    first: list[Block] = []
    if diagnosis is not None and session.results.accepted and {*diagnosis.data.row} == {*found.data.row}:
        first = [*verdict(diagnosis), *causes(diagnosis)]  # they are of this model, and of these rows
    write = partial(write_identification, found, wanted=session.choices.wanted, first=first)
    content, _ = _written("report", write)
    return f"{stem_of(session.robot.name)}-report.zip", content


def fixture_zip(session: Session) -> NotedFile:
    """Everything that a workshop needs to make the current plate, as a folder in a ZIP file.

    Its targets are to be measured as the arm stands on the page.
    """
    from workbench.plate.export import ExportedPlate, export_plate

    targets = tuple(
        replace(target, q=state.q, branch=state.branch) if state.reached else target
        for target, state in zip(session.plate.targets, session.states, strict=True)
    )
    plate = replace(session.plate, targets=targets)
    clear = [(k, state) for k, state in enumerate(session.states, start=1) if state.measurable]
    q = np.array([state.q for _, state in clear]).reshape(-1, session.robot.dof)
    targets_of, branches = [k for k, _ in clear], [state.branch for _, state in clear]
    poses = _poses_csv(session.robot, q, target=targets_of, branch=branches)

    def write(folder: Path) -> ExportedPlate:
        made = export_plate(plate, folder)
        (folder / "poses.csv").write_bytes(poses)
        return made

    content, made = _written("fixture", write)
    why = {text: [n for n, w in made.missing.items() if w == text] for text in made.missing.values()}
    lacking = [f"{' and '.join(names)} not written: {text}" for text, names in why.items()]
    bad = ((k, s.obstacle) for k, s in enumerate(session.states, start=1) if not s.measurable)
    lacking += [f"target {k} is not in poses.csv: it is {why}" for k, why in bad]
    return f"{stem_of(session.plate.name)}-fixture.zip", content, (*made.notes, *lacking)


def _identified(session: Session) -> Identification:
    if session.results.identification is None:
        raise DataError("nothing has been identified yet; press Identify first")
    return session.results.identification


def _calibrated(session: Session) -> Robot:
    """The shown fit's arm, with the reasons on record not to use its files."""
    found = _identified(session)
    if found.identifiability.refused:
        raise DataError(f"there is no calibrated arm to save: {found.identifiability.refused}")
    run = found.runs[session.results.fit]
    return run.calibrated.recorded(refused=found.refused(run))


def _written(name: str, write: Callable[[Path], T]) -> tuple[bytes, T]:
    """A file of this name, or a folder in a ZIP file, as it is written, and what its writer gives."""
    with tempfile.TemporaryDirectory(prefix="workbench-") as room:
        given = write(path := Path(room, name))
        if path.is_file():
            return path.read_bytes(), given
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(path.iterdir()):
                archive.write(file, f"{name}/{file.name}")
        return packed.getvalue(), given


def stem_of(name: str) -> str:
    """A name as the beginning of a file's name."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "file"


def _poses_csv(robot: Robot, q: np.ndarray, **more: list) -> bytes:
    """A table of postures, with more columns by their headings."""
    heads = [f"q{i}[{'mm' if slides else 'deg'}]" for i, slides in enumerate(sliding(robot), 1)]
    out = io.StringIO()
    rows = zip(*shown_joints(robot, q).round(4).T.tolist(), *more.values(), strict=True)
    csv.writer(out).writerows([[*heads, *more], *rows])
    return out.getvalue().encode()

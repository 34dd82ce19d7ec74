"""Commands for measurements: load a file, measure a virtual arm, remove them."""

import io
import re
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import field, replace
from pathlib import Path
from typing import Any

import numpy as np

from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, FileError, OptionError, UnitError, WorkbenchError
from workbench.base.files import DAMAGED
from workbench.base.progress import progress
from workbench.base.wording import plural
from workbench.data.plausibility import checked
from workbench.data.readers.column_meanings import CHOOSE_ON_PAGE
from workbench.data.readers.layouts import file_endings
from workbench.data.readers.read import Preview
from workbench.data.simulation.hidden_effects import hidden_effects
from workbench.data.simulation.instruments import Instrument, Observes
from workbench.data.simulation.simulate import simulate, virtual_arm
from workbench.identification.checks.arm_match import arm_match
from workbench.identification.meaning.as_read import as_read, with_own_columns
from workbench.plate.region_poses import nearby_poses
from workbench.session.command import (
    AbstractChange,
    AbstractCommand,
    AbstractLoad,
    AbstractTask,
    at_stake,
    computed,
    kinds,
)
from workbench.session.commands.compare import with_comparison
from workbench.session.loaded_measurements import BY_HAND, Loaded, MeasurementFile, facts_of
from workbench.session.page_state import Severity
from workbench.session.part import GoesWith
from workbench.session.state import Focus, Measurements, Results, Session
from workbench.session.target_postures import follow_target
from workbench.session.target_steps import begin_step

MAX_FILE_BYTES = 20 * 1024 * 1024
"""Files beyond this size are refused [bytes]."""
CHECK_POSES = 40
"""Poses in the region that a virtual arm is measured at besides the targets, to be held out."""
EARLIER_ERRORS = 5e-3, float(np.deg2rad(5.0))
"""Those of virtual arms in journals that don't say them: largest errors of lengths [m] and angles [rad]."""
MAX_MORE = 500


class LoadData(AbstractTask[Loaded | MeasurementFile]):
    """Read a measurement file and replace the present measurements.

    Args:
        name: Its name, of which only the ending matters.
        content: Its bytes.
        columns: What its columns are, as the option `columns` says it; empty: as its headings say.
        accept: Another reading of the rows that is accepted if it is theirs: `found`, or its name.
    """

    name: str
    content: bytes = field(repr=False)
    columns: str = field(default="", repr=False)
    accept: str | bool = ""

    title = computed(lambda self: f"Read {safe_name(self.name)}")

    def check(self, session: Session) -> None:
        if not self.content:
            raise DataError(f"{safe_name(self.name)} is empty; choose a file with measurements")
        if len(self.content) > MAX_FILE_BYTES:
            text = too_large(self.name, len(self.content), MAX_FILE_BYTES)
            raise DataError(f"{text}; use 'workbench identify' for larger files")

    def removes(self, session: Session) -> str:
        is_read = not session.results.is_empty and isinstance(self.compute(session), Loaded)
        return at_stake(session) if is_read else ""

    def compute(self, session: Session) -> Loaded | MeasurementFile:
        progress(0.0, "reading")
        with as_files({safe_name(self.name): self.content}) as (path,):
            understood = self._understood(path, session.robot, session.robot)
            file = MeasurementFile(path.name, self.content, understood, self.columns)
            if understood.dataset is None:
                # which built-in arm rows are of that can't be the session's, by their number of joints
                is_other = file.is_plain and understood.joints not in (0, session.robot.dof)
                rows = self._understood(path, session.robot, None).dataset if is_other else None
                return file if rows is None else replace(file, match=arm_match(session.robot, rows))
            dataset = understood.dataset
            texts = dataset.missing_units, *dataset.notes
            missing, *notes = (text.replace(f"{path.parent}/", "") for text in texts)
            dataset = replace(dataset, source=path.name, missing_units=missing, notes=tuple(notes))
            dataset = replace(dataset, row=dataset.place, counter="")  # as commands of every journal count
            progress(0.5, "comparing the rows with the arm")
            dataset = with_own_columns(session.robot, dataset)
            if dataset.joints != session.robot.dof:
                text = f"the file has {dataset.joints} joints, the robot {session.robot.dof}"
                wrong = (f"{text}: choose the robot that has them",)
                refused = replace(understood, dataset=None, problems=wrong)
                return replace(file, preview=refused, match=arm_match(session.robot, dataset))
            found = Loaded(dataset, path.name, facts_of(dataset), read=dataset, file=file)
            try:
                how = "found" if self.accept is True else self.accept or ""  # as earlier journals say it
                return matched_to_arm(session.robot, found, accept=how)
            except UnitError as error:  # nor do the rows tell the units that it lacks
                return replace(file, preview=replace(understood, dataset=None, problems=(str(error),)))

    def _understood(self, path: Path, robot: Robot, joints: Robot | None) -> Preview:
        from workbench.data.readers import preview

        found = preview(path, columns=self.columns or None, joints=joints)
        problems = tuple(text.replace(f"{path.parent}/", "") for text in found.problems)
        return replace(found, problems=problems)

    def finish(self, session: Session, result: Loaded | MeasurementFile) -> Session:
        if isinstance(result, MeasurementFile):
            session = session.updated("measurements", unread=result)
            if result.match is not None and result.match.rival:
                return self._warned(session, Severity.WARNING, f"{result.name}: {result.match.text}")
            problem = result.preview.problems[0]
            is_told = not result.is_plain or ", line " in problem or "Columns of the file" in problem
            text = problem if is_told else f"{problem}; or {CHOOSE_ON_PAGE}"
            return self._warned(session, Severity.ERROR, text)
        if result.match is not None and result.is_foreign:
            session = with_other_data(session, result)
            return self._warned(session, Severity.WARNING, f"{result.name}: {result.match.text}")
        text = f"{plural(len(result.dataset), 'row')} read from {result.name}"
        return with_other_data(session.with_message(Severity.LOG, text), result)  # the strip says it

    def _warned(self, session: Session, severity: Severity, text: str) -> Session:
        """With a message that is gone with the file that it is about."""
        return session.with_message(severity, text, refused=type(self).__name__)


class MeasureVirtualArm(AbstractTask[Loaded]):
    """Measure a virtual arm with hidden manufacturing errors at the targets as they stand.

    It is also measured at poses in the region near the targets, which are used for checking only.

    Args:
        seed: Of the hidden errors and of the noise: the same seed is the same arm.
        more: Poses of the region that are measured for fitting besides the targets.
        errors: Largest hidden errors of lengths [m] and angles [rad]; older journals don't say them.
        effects: Also hidden in it, such as `joint-compliance:2`; see `data.simulation.hidden_effects`.
    """

    seed: int = 1
    more: int = 0
    errors: tuple[float, float] = EARLIER_ERRORS
    effects: tuple[str, ...] = ()

    title = computed(lambda self: f"Measure virtual arm {self.seed}")

    def check(self, session: Session) -> None:
        if not all(0.0 <= own <= most for own, most in zip(self.errors, EARLIER_ERRORS, strict=True)):
            length, angle = 1e3 * self.errors[0], np.rad2deg(self.errors[1])
            raise OptionError(f"hidden errors must be 0 to 5 mm and 0 to 5°, got {length:g} mm, {angle:g}°")
        if self.seed < 0:
            raise OptionError(f"the seed must be 0 or more, got {self.seed}", option="seed", found=self.seed)
        if not 0 <= self.more <= MAX_MORE:
            raise OptionError(f"the number of extra poses must be 0 to {MAX_MORE}, got {self.more}")
        if not any(state.measurable for state in session.states):
            raise DataError("the arm reaches no target; drag some within reach, or choose other branches")

    removes = AbstractLoad.removes

    def compute(self, session: Session) -> Loaded:
        rng = np.random.default_rng(self.seed)
        robot = session.robot
        progress(0.1, "building the arm")
        actual = virtual_arm(robot, rng=rng, errors=self.errors)
        actual = actual.with_effects(*actual.effects, *hidden_effects(actual, self.effects, rng=rng)[0])
        place, turn, name = session.noise.position, session.noise.rotation, "as set in the Plate tab"
        pose = Observes.POSE
        instrument = Instrument(name=name, observes=pose, sigma_position=place, sigma_rotation=turn)
        progress(0.3, "measuring at the targets")
        pairs = zip(session.plate.targets, session.states, strict=True)
        stood = [follow_target(actual, target, state) for target, state in pairs if state.measurable]
        if not (reached := [state.q for state in stood if state.reached]):  # by whichever branch is near
            raise DataError("the virtual arm reaches no target; try another seed or move the targets")
        near = np.stack(reached)
        rows = simulate(actual, Motion(near), instrument=instrument, rng=rng)
        progress(0.6, "measuring in the region")
        around = nearby_poses(robot, session.plate.region, CHECK_POSES + self.more, rng=rng, measured=near)
        seen = simulate(actual, Motion(around), instrument=instrument, rng=rng)
        checks = seen.take(np.arange(CHECK_POSES))
        rows = rows.joined(replace(seen.take(np.arange(CHECK_POSES, len(seen))), row=np.arange(self.more)))
        name = f"Virtual arm {self.seed}"
        rows = replace(rows, source=name)
        length, angle = 1e3 * self.errors[0], np.rad2deg(self.errors[1])
        facts = (
            *facts_of(rows),
            ("Targets", f"{len(near)} of {len(session.states)}"),
            ("Held out", f"{CHECK_POSES} more poses in the region near the targets"),
            ("Hidden errors", f"up to {length:.3g} mm and {angle:.3g}° per constant"),
        )
        return Loaded(rows, name, facts, virtual=True, checks=checks, actual=actual)

    def finish(self, session: Session, result: Loaded) -> Session:
        text = f"{result.name} was measured at {plural(len(result.dataset), 'pose')}"
        return with_other_data(session, result).with_message(Severity.LOG, text)


class ForgetData(AbstractChange):
    """Remove the measurements and what was identified from them."""

    title = "Remove the measurements"
    key = "forget"

    def check(self, session: Session) -> None:
        if session.measurements.loaded is None:
            raise DataError("there are no measurements to remove")

    def apply(self, session: Session) -> Session:
        return with_other_data(session, None)


def matched_to_arm(robot: Robot, loaded: Loaded, *, accept: str = "") -> Loaded:
    """Measurements of a file, read as they are this arm's, with all notes; as given while it is asked."""
    assert loaded.read is not None
    rows = with_own_columns(robot, loaded.read)
    match = arm_match(robot, rows)
    if not match.is_foreign or accept in match.readings:
        rows = as_read(robot, rows, accept or "found", keeps_arm=True)[1]
        match = replace(match, meaning=None)
    dataset = rows if match.rival or match.readings else checked(robot, rows)
    return replace(loaded, dataset=dataset, notes=dataset.notes, match=match)


def measurements(session: Session) -> Loaded:
    """The loaded measurements; refused if there are none."""
    if session.measurements.loaded is None:
        raise DataError("there are no measurements yet; load a file or measure a virtual arm first")
    return session.measurements.loaded


def fitted_rows(session: Session, held_out: float, seed: int) -> dict[str, Any]:
    """The rows, and what of them counts, as `identify` and `diagnose` take it."""
    loaded = measurements(session)
    return {
        "data": loaded.dataset,
        "held_out": held_out if loaded.checks is None else loaded.checks,
        "free": session.robot.default_free,
        "exclude": dict.fromkeys(sorted(session.measurements.left_out), BY_HAND),
        "levelled": session.measurements.levelled,
        "reading": "given",  # the rows were read when they were loaded
        "seed": seed,
    }


def check_unchanged(session: Session, loaded: Loaded, what: str) -> None:
    """Refuse a result of measurements that are no longer there; `what`: to do instead."""
    if session.measurements.loaded is not loaded:
        raise DataError(f"the measurements have changed since; {what} again")


def check_same_arm(session: Session, *, anyway: bool) -> None:
    """Refuse rows of another arm, unless forced."""
    loaded = measurements(session)
    if loaded.match is not None and loaded.is_foreign and not anyway:
        raise DataError(loaded.match.text)


def load_command(name: str, content: bytes) -> AbstractCommand:
    """The command that reads a measurement file: that of an extra for its endings, or `LoadData`."""
    with suppress(*DAMAGED), zipfile.ZipFile(io.BytesIO(content)) as archive:  # with a table alone in it
        files = [f for f in archive.infolist() if not f.is_dir() and not f.filename.startswith("__MACOSX")]
        is_table = len(files) == 1 and files[0].filename.lower().endswith(file_endings())
        if name.lower().endswith(".zip") and is_table and files[0].file_size <= MAX_FILE_BYTES:
            name, content = Path(files[0].filename).name, archive.read(files[0])
    found = next((kind for kind in _loads() if name.lower().endswith(kind.endings)), LoadData)
    return found(name=name, content=content)  # type: ignore[call-arg]


def load_endings() -> tuple[str, ...]:
    """Of the names of all files that `load_command` takes, in lower case."""
    return (*file_endings(), *(end for kind in _loads() for end in kind.endings))


def _loads() -> Iterator[type[AbstractLoad]]:
    return (kind for kind in kinds().values() if issubclass(kind, AbstractLoad))


def packed(folder: Path) -> tuple[str, bytes]:
    """Name and content of the file that `load_command` takes for a folder of measurements."""
    for kind in _loads():
        if (found := kind.packed(folder)) is not None:
            return found
    raise FileError("is a folder, and no installed extension reads folders; give a file", path=str(folder))


def with_other_data(session: Session, loaded: Loaded | None) -> Session:
    """As `with_data`; undo restores the old ones with their results."""
    return with_data(begin_step(session, is_whole=True), loaded)


def with_data(session: Session, loaded: Loaded | None) -> Session:
    """The session with other measurements, or none; results from the old ones are dropped."""
    kept = session.with_parts(GoesWith.PLATE, GoesWith.PAGE)
    session = replace(kept, measurements=Measurements(loaded=loaded), results=Results())
    focus = Focus.TARGET if loaded is None or loaded.virtual else Focus.ROW
    return with_comparison(session.updated("playback", focus=focus))


def too_large(name: str, size: int, maximum: int) -> str:
    """Why a file of so many bytes is refused, without the remedy."""
    has, accepts = (f"{bytes_ / 2**20:.0f} MiB" for bytes_ in (size, maximum))
    return f"{safe_name(name)} has {has}, but the page accepts up to {accepts}"


@contextmanager
def as_files(contents: Mapping[str, bytes]) -> Iterator[list[Path]]:
    """Contents by their names as files, for as long as they are read; no message names their folder."""
    with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
        for name, content in contents.items():
            Path(folder, name).write_bytes(content)
        try:
            yield [Path(folder, name) for name in contents]
        except WorkbenchError as error:
            raise DataError(str(error).replace(f"{folder}/", "")) from error


def safe_name(name: str) -> str:
    """The last part of a file name, of harmless characters only; its ending is kept."""
    return re.sub(r"[^\w.+ ()-]", "_", re.split(r"[/\\]", name)[-1])[-80:].lstrip(".") or "file"

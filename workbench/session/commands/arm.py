"""Commands for the arm and the plate as a whole: changing the arm or plate, jogging."""

import atexit
import io
import re
import shutil
import tempfile
import zipfile
from contextlib import suppress
from dataclasses import field, replace
from functools import cache
from pathlib import Path

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.inverse.solve import follow
from workbench.arm.meshes import link_meshes
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.errors import FileError, OptionError, WorkbenchError
from workbench.base.files import DAMAGED, unpacked
from workbench.base.progress import progress
from workbench.base.types import frozen
from workbench.parts import parts
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import read_plate
from workbench.session.command import AbstractChange, AbstractTask, at_stake, computed
from workbench.session.commands.data import LoadData, matched_to_arm, safe_name, with_data
from workbench.session.loaded_measurements import Loaded, MeasurementFile
from workbench.session.page_state import Severity
from workbench.session.part import GoesWith
from workbench.session.start import default_plate, is_default_plate, start
from workbench.session.state import Focus, Session
from workbench.session.target_steps import begin_step, check_free, instrument_for

LARGEST_MODEL = 2 * 1024 * 1024
"""Robot and plate files beyond this size are refused [bytes]."""
LARGEST_ARCHIVE, LARGEST_UNPACKED, MAX_FILES = 64 * 2**20, 256 * 2**20, 2000
"""Likewise archives of a URDF and its meshes, what they hold, and with how many files."""
UNPACKED = (".urdf", ".stl", ".dae", ".obj", ".ply", ".mtl", ".png", ".jpg", ".jpeg")
"""What is taken from such an archive, by its ending."""


class ChooseRobot(AbstractTask[Session]):
    """Start over with another built-in robot; undo restores the current one with its measurements.

    Args:
        name: Which one.
        keep: Whether the measurements are this robot's, and stay.
        reading: Which of their readings the current robot counts its joints by, so that what is saved does;
            the rows are changed where an arm can't.
    """

    name: str
    keep: bool = False
    reading: str = ""

    title = computed(lambda self: f"Read so: {self.reading}" if self.reading else f"Choose robot {self.name}")

    def check(self, session: Session) -> None:
        check_free(session)
        loaded = session.measurements.loaded
        if self.keep and self._unread(session) is None and (loaded is None or loaded.read is None):
            raise OptionError("there are no measurements from a file to keep")

    def removes(self, session: Session) -> str:
        return "" if self.keep else at_stake(session)

    def compute(self, session: Session) -> Session:
        progress(0.2, "solving inverse kinematics for the targets")
        loaded = session.measurements.loaded
        if self.reading and loaded is not None:
            return self._counted(session, loaded)
        if self.name.lower() not in (known := built_in_robots()):  # a journal may say anything
            text = f"unknown arm '{self.name}'; built-in: {', '.join(known)}"
            raise OptionError(text, option="name", found=self.name)
        robot = load_robot(self.name)
        if self.keep and (file := self._unread(session)) is not None:
            begun = start_with(robot, session)
            again = LoadData(file.name, file.content, file.columns)
            return again.finish(begun, again.compute(begun))
        loaded = matched_to_arm(robot, loaded) if self.keep and loaded is not None else None
        begun = start_with(robot, session)
        return begun if loaded is None else with_data(begun, loaded)

    def _counted(self, session: Session, loaded: Loaded) -> Session:
        meaning = None if loaded.match is None else loaded.match.meaning
        read = None if meaning is None else meaning.accepted(self.reading)
        robot = None if read is None else read.on(session.robot)
        if read is None or robot is None or robot is session.robot:
            return with_data(session, matched_to_arm(session.robot, loaded, accept=self.reading))
        robot = replace(robot, notes=(*robot.notes, f"change: {read.text}"))
        return with_data(start_with(robot, session), matched_to_arm(robot, loaded))

    def _unread(self, session: Session) -> MeasurementFile | None:
        """The file that was given last and is this robot's, though the session's robot can't read it."""
        file = session.measurements.unread
        if file is None or session.measurements.loaded is None:
            return file
        return file if file.match is not None and file.match.rival == self.name else None

    def finish(self, session: Session, result: Session) -> Session:
        begun, loaded = _in_the_page(session, result), result.measurements.loaded
        if loaded is None or self.reading:
            return begun
        text = f"{loaded.name}: rows of the {begun.robot.name}; if yours is another, open your robot's file"
        begun = begun.updated("measurements", loaded=replace(loaded, notes=(*loaded.notes, text)))
        return begun.with_message(Severity.WARNING, text)


class LoadModel(AbstractTask[Session]):
    """Start over with a robot or plate from a file; a URDF with its meshes comes in a ZIP file.

    Args:
        name: Its name, of which only the ending matters.
        content: Its bytes.
        poses: Lines as on the pendant, or of a table of measured rows, that the robot must give; without any,
            a joint table (.csv) may mean one arm only.
    """

    name: str
    content: bytes = field(repr=False)
    poses: tuple[str, ...] = ()

    title = computed(lambda self: f"Open {safe_name(self.name)}")

    def check(self, session: Session) -> None:
        check_free(session)
        largest = LARGEST_ARCHIVE if self._is_archive else LARGEST_MODEL
        if not 0 < len(self.content) <= largest:
            raise FileError(
                f"has {len(self.content) / 2**20:.1f} MiB; give a robot (TOML, URDF, or a ZIP of URDF and "
                f"meshes) or plate (TOML) of at most {largest // 2**20} MiB",
                path=safe_name(self.name),
            )

    def removes(self, session: Session) -> str:
        return (lost := at_stake(session)) and ("" if isinstance(self.model(), Plate) else lost)

    def compute(self, session: Session) -> Session:
        progress(0.1, "reading")
        if not isinstance(model := self.model(), Plate):
            return start_with(model, session)
        return replace(  # measurements of the same arm, and what was found from them, stay
            start(session.robot, model, is_given=True, noise=instrument_for(session, model)),
            choices=session.choices,
            measurements=session.measurements,
            results=session.results,
            parts=session.with_parts(GoesWith.MEASUREMENTS).parts,
        )

    def model(self) -> Robot | Plate:
        """What the file holds."""
        folder = Path(tempfile.mkdtemp(dir=_uploads()))
        path = folder / safe_name(self.name)
        path.write_bytes(self.content)
        try:
            if self._is_archive:
                held = unpacked(path, UNPACKED, LARGEST_UNPACKED, MAX_FILES)
                found = sorted(held.rglob("*.[uU][rR][dD][fF]"))
                if len(found) != 1:
                    names = ", ".join(one.name for one in found[:5]) or "none"
                    raise FileError(f"must hold one URDF with its meshes; found {names}", path=path.name)
                path = found[0]
            if b"[[target]]" in self.content:
                return read_plate(path)
            if not self.poses and path.suffix.lower() != ".csv":
                return load_robot(path)
            (rows := folder / "rows.csv").write_text("\n".join(self.poses))
            for check in parts("robot_checks"):
                return check(path, rows if self.poses and "=" not in self.poses[0] else self.poses)
            raise OptionError("tables and poses need workbench.extras.pendant, which isn't installed")
        except WorkbenchError as error:
            raise OptionError(str(error).replace(f"{folder}/", "")) from error

    def finish(self, session: Session, result: Session) -> Session:
        opened = _in_the_page(session, result)
        names_some = self._is_archive or b"<mesh" in self.content
        if result.robot.urdf is None or not names_some or link_meshes(result.robot):
            return opened
        text = "shown without its meshes, which this file lacks; open a ZIP of the URDF with their folder"
        return opened.with_message(Severity.INFO, f"{opened.page.messages[-1].text}; {text}")

    @property
    def _is_archive(self) -> bool:
        return self.name.lower().endswith(".zip")


def holds_robot(name: str, content: bytes) -> bool:
    """Whether a file is a robot's, as an archive with a URDF in it or a joint table is."""
    if name.lower().endswith((".toml", ".urdf", ".xml", ".xacro")):
        return True
    if name.lower().endswith(".csv"):
        words = set(re.findall(r"[a-zα]+", content[:400].decode(errors="replace").lower()))  # its headings
        return {"d", "a"} <= words and bool(words & {"alpha", "α", "twist"})
    with suppress(*DAMAGED):
        if name.lower().endswith(".zip"):
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                return any(one.lower().endswith(".urdf") for one in archive.namelist())
    return False


@cache
def _uploads() -> str:
    """Folder of the uploaded files, there as long as the program: a calibrated URDF is a copy of one."""
    folder = tempfile.mkdtemp(prefix="workbench-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


class Jog(AbstractChange):
    """Move the arm in the scene to these joint positions; nothing is measured.

    Args:
        q: Joint positions [rad or m].
    """

    title = "Jog the arm"
    key = "jog"

    q: tuple[float, ...]

    def check(self, session: Session) -> None:
        session.robot.check_joints(np.array([self.q]))
        for i, (value, (low, high)) in enumerate(zip(self.q, session.robot.limits, strict=True)):
            if not (np.isfinite(value) and low - 1e-6 <= value <= high + 1e-6):
                raise OptionError(f"joint {i + 1} must be {low:.4g} to {high:.4g}, got {value:.4g}")

    def apply(self, session: Session) -> Session:
        return session.updated("playback", focus=Focus.JOG, jogged=frozen(np.array(self.q)))


class JogTo(AbstractChange):
    """Move the tool to a typed pose, by the solution nearest to the current posture.

    Args:
        xyz: Position of the tool, robot's base [m].
        rpy: Its roll, pitch, yaw [rad].
    """

    title = "Move the tool to a pose"
    key = "jog"

    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]

    def check(self, session: Session) -> None:
        if not np.isfinite((*self.xyz, *self.rpy)).all():
            raise OptionError("the pose must be finite numbers")

    def apply(self, session: Session) -> Session:
        pose = se3.pose(se3.rpy_to_matrix(np.array(self.rpy)), np.array(self.xyz))
        found = follow(session.robot, session.robot.base.pose @ pose, drawn_joints(session))
        session = session.updated("playback", focus=Focus.JOG, jogged=found.q)
        if found.converged:
            return session
        short = f"{1e3 * found.position_error:.1f} mm and {np.rad2deg(found.rotation_error):.1f}° short of"
        text = f"the arm stops {short} that pose; choose one within reach"
        return session.with_message(Severity.WARNING, text)


def drawn_joints(session: Session) -> np.ndarray:
    """Joint positions of the arm as it is drawn [rad or m]."""
    if session.playback.focus is Focus.ROW and session.results.comparison is not None:
        return session.results.comparison.q[session.results.row]
    if session.playback.focus is Focus.JOG and session.playback.jogged is not None:
        return session.playback.jogged
    return session.states[session.selected].q


def start_with(robot: Robot, session: Session) -> Session:
    """A session with another robot: on its own plate, or on the user's.

    That one has to stand clear of the robot's base, which must reach half of its targets. Joint positions
    of an arm with another number of joints don't go with it.
    """
    from workbench.plate.optimiser.constraints import is_clear_of

    if not is_default_plate(session) and is_clear_of(robot, session.plate):
        is_its_own = [t.q is None or len(t.q) == robot.dof for t in session.plate.targets]
        both = zip(session.plate.targets, is_its_own, strict=True)
        plate = replace(session.plate, targets=tuple(t if own else replace(t, q=None) for t, own in both))
        begun = start(robot, plate, is_given=session.is_plate_given, noise=session.noise)
        if 2 * begun.score.measurable >= len(plate):
            return begun
    plate = default_plate(robot)
    return start(robot, plate, noise=instrument_for(session, plate))


def _in_the_page(session: Session, begun: Session) -> Session:
    begun = replace(
        begun,
        page=replace(session.page, messages=begun.page.messages),
        history=replace(begun.history, done=begin_step(session, is_whole=True).history.done),
        parts={**begun.parts, **session.with_parts(GoesWith.PAGE).parts},
    )
    reached = f"{begun.score.measurable} of {len(begun.plate)} targets measurable"
    text = f"{begun.robot.name} on the plate '{begun.plate.name}': {reached}"
    told = "it fits:", "change:", "left open:", "errors at"
    checked = (note.partition(";")[0] for note in begun.robot.notes if note.startswith(told))
    return begun.with_message(Severity.INFO, "; ".join([text, *checked]))

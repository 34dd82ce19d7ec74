"""The demo: about two minutes of commands like those of a user; any other command ends it."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import cycle

import numpy as np

from workbench.base.assets import assets
from workbench.base.wording import capital
from workbench.diagnosis.result import Diagnosis
from workbench.report.numbers import compared
from workbench.session.command import AbstractCommand
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.compare import SetOverlay, ShowRow
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, plain
from workbench.session.commands.identify import Identify
from workbench.session.commands.messages import OpenTab, SetCaption, Steer, SteerDemo
from workbench.session.commands.plate import SetNoise
from workbench.session.commands.undo import RestoreBest
from workbench.session.comparison import ModelStage
from workbench.session.page_state import Tab
from workbench.session.stages import expected_elsewhere, learned, stages
from workbench.session.state import Session
from workbench.session.worker import Worker

CLIENT = 1_000_000
"""Who drags in the demo: no browser has this number."""
ROBOT, ROWS = "ur10", "ur10.csv"
"""A real arm, and rows that a laser tracker took of it (`assets/samples`)."""
TRACKER = 5e-5, 2.5e-4
"""Its noise at the plate [m], [rad]."""
DRAG_PLACES = 45
"""Places of one drag."""
TICK = 0.1
"""How soon a button of the demo is heard [s]."""
END = "Held-out errors: nominal, geometry, all."
"""Behind what was found; it stands until somebody does something."""
RULES = "A cause has to beat all others, also at held-out poses …"
MAX_COMMAND_TIME = 300.0
"""Longest time that a command takes [s]."""


@dataclass(frozen=True)
class DemoScene:
    """One step of the story.

    Args:
        caption: Empty: what was said before still stands.
        commands: What is done, one after the other.
        seconds: How long it stands afterwards, or in all for many commands.
        tab: Where its outcome is seen; None: where that of the scene before was.
        is_last: Whether nothing follows.
    """

    caption: str
    commands: tuple[AbstractCommand, ...] = ()
    seconds: float = 6.0
    tab: Tab | None = None
    is_last: bool = False


class Demo:
    """Plays with a worker's session in a thread of its own; the pace is a factor on all waiting times."""

    def __init__(self, worker: Worker, *, pace: float = 1.0):
        self._worker, self._pace = worker, pace
        self._stop = threading.Event()
        self._on = threading.Event()
        self._on.set()
        self._mine: AbstractCommand | None = None
        self.is_finished = False
        worker.listen(self._heard)
        self._thread = threading.Thread(target=self._run, name="workbench-demo", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End it where it stands."""
        self._stop.set()
        self._on.set()

    def join(self, timeout: float) -> None:
        """Wait for its end."""
        self._thread.join(timeout)

    def _heard(self, command: AbstractCommand) -> None:
        if isinstance(command, SteerDemo):
            (self._on.clear if command.how is Steer.PAUSE else self._on.set)()
        elif command is not self._mine and not command.is_automatic:
            self.stop()

    def _run(self) -> None:
        for scene in story(lambda: self._worker.session):
            if self._stop.is_set():
                break
            self._play(scene)
        else:  # the last picture, in which the arms go on
            self.is_finished = True
            rows = cycle(range(0, 120, 12))
            while not self._stop.is_set():
                self._submit(ShowRow(next(rows)))
                self._wait(1.5)
        self._leave()

    def _play(self, scene: DemoScene) -> None:
        """Play one scene to its end, or until the user stops."""
        if scene.caption:
            self._submit(SetCaption(scene.caption, scene.is_last))
        if scene.tab is not None:
            self._submit(OpenTab(scene.tab))
        for command in scene.commands or (None,):
            if command is not None:
                self._submit(command)
            self._wait_for_end()
            self._wait(scene.seconds / max(len(scene.commands), 1))

    def _wait(self, seconds: float) -> None:
        """Wait for this long, not counting pauses."""
        end = time.monotonic() + self._pace * seconds
        while not self._stop.is_set() and (left := end - time.monotonic()) > 0.0:
            if not self._on.is_set():
                begin = time.monotonic()
                self._on.wait()
                end += time.monotonic() - begin
            self._stop.wait(min(left, TICK))

    def _wait_for_end(self) -> None:
        """Until what was begun has ended; meanwhile the arm goes through the measured rows.

        What leads in a diagnosis by then is said with how it decides.
        """
        for k in range(int(MAX_COMMAND_TIME)):
            if self._stop.is_set() or self._worker.wait(1.0):
                return
            session = self._worker.session
            if (rows := session.results.comparison) is not None:
                self._submit(ShowRow(8 * k % len(rows)))
            if k % 6 == 5 and session.page.job is not None and (found := session.page.job.suspects):
                so_far = f"{capital(max(found, key=lambda name: found[name]))}: so it seems by now. {RULES}"
                self._submit(SetCaption(so_far))

    def _submit(self, command: AbstractCommand, *, is_end: bool = False) -> None:
        if is_end or not self._stop.is_set():
            self._mine = command
            self._worker.submit(command)

    def _leave(self) -> None:
        """Take back a drag under way, and remove the caption."""
        self._submit(DropTarget(CLIENT, back=True), is_end=True)
        self._submit(SetCaption(""), is_end=True)


def story(session: Callable[[], Session]) -> Iterator[DemoScene]:
    """The scenes; later ones look at what earlier ones led to."""
    yield DemoScene("", (ChooseRobot(ROBOT), SetNoise(*TRACKER)), seconds=0.0, tab=Tab.PLATE)
    yield DemoScene("No arm is built exactly as its data sheet says. How far is it off, and why?")
    yield DemoScene(
        "To find out, measure it at targets on a plate. Colours show the error expected after calibration.",
        seconds=7.0,
    )
    yield DemoScene(
        "Drag a target: the arm follows, and the number and colours show at once how good its position is.",
        drag(session(), 6, np.array([0.25, 0.05, 0.05])),
        seconds=10.0,
    )
    yield DemoScene("One button returns to the best plate so far.", (RestoreBest(),), seconds=5.0)
    yield DemoScene(
        "Now a real arm: a UR10 measured with a laser tracker in 1200 poses at Fraunhofer IPA in Stuttgart.",
        (LoadData(ROWS, (assets() / "samples" / ROWS).read_bytes()),),
        seconds=7.0,
        tab=Tab.MEASURE,
    )
    yield DemoScene(
        "Its geometry is identified and checked at held-out poses …",
        (Identify(),),
        seconds=3.0,
        tab=Tab.CALIBRATE,
    )
    overlay = session().choices.overlay
    yield DemoScene(
        f"All errors are drawn × {overlay.exaggeration:g}: blue and grey is the arm of the data sheet, "
        "orange the real one.",
        (SetOverlay(replace(overlay, stage=ModelStage.NOMINAL)), *map(ShowRow, range(0, 120, 12))),
        seconds=10.0,
    )
    yield DemoScene(
        "With its geometry identified, the model comes nearer to the real arm.",
        (SetOverlay(overlay), *map(ShowRow, range(108, -12, -12))),
        seconds=8.0,
    )
    sentence = "Geometry can't explain the remaining error. The diagnosis looks for its causes …"
    yield DemoScene(sentence, (Diagnose(),), seconds=1.0)
    found = session().results.diagnosis
    causes = "" if found is None else _causes(found)
    if found is not None and found.effects:
        yield DemoScene(f"Found: {_found(session(), found, causes)}", seconds=8.0)
        yield DemoScene("One button adds what was found to the model …", (AddEffects(),), seconds=2.0)
        far = expected_elsewhere(session())
        only = f" near the measured poses; far from them, expect {compared(far)} mm" if far > 0.0 else ""
        yield DemoScene(f"The model moves to where the arm is{only}.", tuple(map(ShowRow, range(0, 120, 12))))
    why = f"Geometry was off{f', {causes}' if causes else ''}{_learned(found)}. "
    yield DemoScene(f"{why}{END}", seconds=1.0, is_last=True)


def _causes(found: Diagnosis) -> str:
    """The largest cause, and how many more there are: the panel names them all."""
    largest, more = (cause.plain for cause in found.causes[:1]), len(found.causes) - 1
    return "".join(largest) + (f", and {more} more" if more > 0 else "")


def _found(session: Session, found: Diagnosis, causes: str) -> str:
    """The causes, and what is learned without a name; with the numbers that the page shows."""
    errors = stages(session)[-1].errors, found.after.judged
    before, after = (compared(e.position_mm.mean) for e in errors)
    what = f"{causes or 'no cause with a name'}{_learned(found)}"
    return f"{what}. With that, {before} mm fall to {after} mm."


def _learned(found: Diagnosis | None) -> str:
    """How much of what geometry leaves is only learned."""
    much = "" if found is None else learned(found)
    return much and f"; a learned correction covers {much}"


def drag(session: Session, target: int, offset: np.ndarray) -> tuple[AbstractCommand, ...]:
    """Moving a target by an offset, and half of it back."""
    start = session.plate.targets[target]
    places = (start.xyz + share * offset for share in np.sin(np.linspace(0.0, 0.8 * np.pi, DRAG_PLACES)))
    moves = (MoveTarget(target, plain(place), plain(start.rpy), CLIENT) for place in places)
    return (GrabTarget(target, CLIENT), *moves, DropTarget(CLIENT))

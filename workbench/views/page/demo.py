"""The demo: about two minutes of commands like those of a user; any other command ends it."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from workbench.session.command import AbstractCommand
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.commands.identify import Identify
from workbench.session.commands.messages import OpenTab, SetCaption, Steer, SteerDemo, Tell
from workbench.session.commands.region import ShowCubes
from workbench.session.commands.undo import RestoreBest
from workbench.session.state import CubeView, Field, Session, Severity, Tab
from workbench.session.worker import Worker

CLIENT = 1_000_000
"""Who drags in the demo: no browser has this number."""
SEED, POSES = 5, 70
STEPS = 45
"""Places of one drag."""
TICK = 0.1
"""How soon a button of the demo is heard [s]."""
END = "That is the whole workflow: design, measure, identify, diagnose. Over to you."


@dataclass(frozen=True)
class Scene:
    """One step of the story.

    Args:
        caption: Empty: what was said before still stands.
        commands: What is done, one after the other.
        seconds: How long it stands afterwards, or in all for many commands.
        tab: Where its outcome is seen.
    """

    caption: str
    commands: tuple[AbstractCommand, ...] = ()
    seconds: float = 6.0
    tab: Tab = Tab.PLATE


class Demo:
    """Plays with a worker's session in a thread of its own; the pace is a factor on all waiting times."""

    def __init__(self, worker: Worker, *, pace: float = 1.0):
        self._worker, self._pace = worker, pace
        self._stop, self._back = threading.Event(), threading.Event()
        self._on = threading.Event()
        self._on.set()
        self._mine: AbstractCommand | None = None
        self._tab: Tab | None = None
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
            if command.how is Steer.BACK:
                self._back.set()
            (self._on.clear if command.how is Steer.PAUSE else self._on.set)()
        elif command is not self._mine:
            self.stop()

    def _run(self) -> None:
        scenes = story(lambda: self._worker.session)
        told: list[Scene] = []
        at = 0
        while not self._stop.is_set():
            if at == len(told):
                if (scene := next(scenes, None)) is None:
                    self.is_finished = True
                    break
                told.append(scene)
            self._tell(told[at])
            at = max(at - 1, 0) if self._back.is_set() else at + 1
            self._back.clear()
        self._leave()

    def _tell(self, scene: Scene) -> None:
        """Play one scene to its end, or until the user goes back or stops."""
        if scene.caption:
            self._submit(SetCaption(scene.caption))
        if scene.tab is not self._tab:
            self._tab = scene.tab
            self._submit(OpenTab(scene.tab))
        for command in scene.commands:
            if self._back.is_set():
                return
            self._submit(command)
            self._worker.wait(60.0)
            self._wait(scene.seconds / len(scene.commands))
        if not scene.commands:
            self._wait(scene.seconds)

    def _wait(self, seconds: float) -> None:
        """Wait for this long, not counting pauses."""
        end = time.monotonic() + self._pace * seconds
        while not (self._stop.is_set() or self._back.is_set()) and (left := end - time.monotonic()) > 0.0:
            if not self._on.is_set():
                begin = time.monotonic()
                self._on.wait()
                end += time.monotonic() - begin
            self._stop.wait(min(left, TICK))

    def _submit(self, command: AbstractCommand) -> None:
        if self._stop.is_set():
            return
        self._mine = command
        self._worker.submit(command)

    def _leave(self) -> None:
        """Release any target, remove the caption, and say goodbye if the demo was completed."""
        last: list[AbstractCommand] = [DropTarget(CLIENT), SetCaption("")]
        if self.is_finished:
            last.append(Tell(END, Severity.INFO))
        for command in last:
            self._mine = command
            self._worker.submit(command)


def story(session: Callable[[], Session]) -> Iterator[Scene]:
    """The scenes; later ones look at what earlier ones led to."""
    yield Scene(
        "ARIA and its calibration tool: ten targets that the arm has to visit. How well would measurements "
        "there determine its geometry?",
        seconds=8.0,
    )
    yield Scene(
        "A target is dragged; the arm follows, and the numbers immediately show how good the position is.",
        drag(session(), 0, np.array([-0.10, -0.14, 0.08])),
        seconds=9.0,
    )
    yield Scene(
        "The cubes show the predicted error throughout the region and are updated during the drag.",
        (ShowCubes(CubeView(field=Field.PREDICTED)),),
        seconds=6.0,
        tab=Tab.REGION,
    )
    yield Scene("", drag(session(), 5, np.array([0.12, 0.10, 0.06])), seconds=9.0, tab=Tab.REGION)
    yield Scene(
        "One button returns to the best plate so far.", (RestoreBest(), ShowCubes(CubeView())), seconds=6.0
    )
    yield Scene(
        "A virtual arm is measured; it has hidden manufacturing errors and one effect that geometry can't "
        "explain.",
        (MeasureVirtualArm(SEED, surprise=True, more=POSES),),
        seconds=7.0,
        tab=Tab.MEASURE,
    )
    yield Scene("Three algorithms identify its geometry …", (Identify(),), seconds=8.0, tab=Tab.IDENTIFY)
    yield Scene(
        "The solid arm is nominal, the amber one calibrated; arrows show the errors, exaggerated.",
        tuple(ShowRow(row) for row in range(0, 40, 4)),
        seconds=12.0,
        tab=Tab.COMPARE,
    )
    yield Scene(
        "The remaining error is not geometric. The diagnosis looks for the cause …",
        (Diagnose(),),
        seconds=8.0,
        tab=Tab.DIAGNOSE,
    )
    found = session().diagnosis
    if found is not None and found.effects:
        causes = "; ".join(cause.sentence for cause in found.causes) or found.message.rstrip(".")
        yield Scene(f"Found: {causes}.", seconds=8.0, tab=Tab.DIAGNOSE)
        yield Scene(
            "The effect is added to the model, and the error falls. The violet arm shows its deflection, "
            "exaggerated.",
            (AddEffects(),),
            seconds=10.0,
            tab=Tab.IDENTIFY,
        )


def drag(session: Session, target: int, offset: np.ndarray) -> tuple[AbstractCommand, ...]:
    """Moving a target by an offset, and half of it back."""
    start = session.plate.targets[target]
    roll, pitch, yaw = start.rpy.tolist()
    moves: list[AbstractCommand] = []
    for share in np.sin(np.linspace(0.0, 0.8 * np.pi, STEPS)):
        x, y, z = (start.xyz + share * offset).tolist()
        moves.append(MoveTarget(target, (x, y, z), (roll, pitch, yaw), CLIENT))
    return (GrabTarget(target, CLIENT), *moves, DropTarget(CLIENT))

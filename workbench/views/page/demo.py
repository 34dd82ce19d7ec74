"""The demo: a story of about two minutes, told with commands like a user's; any other command ends it."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from workbench.session.command import AbstractCommand
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.commands.identify import Identify
from workbench.session.commands.messages import SetCaption, Tell
from workbench.session.commands.region import ShowCubes
from workbench.session.commands.undo import RestoreBest
from workbench.session.state import CubeView, Field, Session, Severity
from workbench.session.worker import Worker

CLIENT = 1_000_000
"""Who drags in the demo: no browser has this number."""
SEED, POSES = 5, 70
STEPS = 45
"""Places of one drag."""
END = "That is the whole workflow: design, measure, identify, diagnose. Over to you."


@dataclass(frozen=True)
class Scene:
    """One step of the story.

    Args:
        caption: What is said; empty: what was said before still stands.
        commands: What is done, one after the other.
        seconds: How long it stands afterwards, or in all for many commands.
    """

    caption: str
    commands: tuple[AbstractCommand, ...] = ()
    seconds: float = 6.0


class Demo:
    """Runs in a thread of its own.

    Args:
        worker: Whose session it plays with.
        pace: Factor on all waiting times.
    """

    def __init__(self, worker: Worker, *, pace: float = 1.0):
        self._worker, self._pace = worker, pace
        self._stop = threading.Event()
        self._mine: AbstractCommand | None = None
        self.is_finished = False
        worker.listen(self._heard)
        self._thread = threading.Thread(target=self._run, name="workbench-demo", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End it where it stands."""
        self._stop.set()

    def join(self, timeout: float) -> None:
        """Wait for its end."""
        self._thread.join(timeout)

    def _heard(self, command: AbstractCommand) -> None:
        if command is not self._mine:
            self._stop.set()

    def _run(self) -> None:
        for scene in story(lambda: self._worker.session):
            if scene.caption:
                self._submit(SetCaption(scene.caption))
            for command in scene.commands:
                self._submit(command)
                self._worker.wait(60.0)
                self._stop.wait(self._pace * scene.seconds / max(len(scene.commands), 1))
            if not scene.commands:
                self._stop.wait(self._pace * scene.seconds)
            if self._stop.is_set():
                break
        self.is_finished = not self._stop.is_set()
        self._leave()

    def _submit(self, command: AbstractCommand) -> None:
        if self._stop.is_set():
            return
        self._mine = command
        self._worker.submit(command)

    def _leave(self) -> None:
        """Let go what is held, take the caption away, and say goodbye if the story was told."""
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
        "A target is dragged; the arm follows, and the numbers show at once what the position is worth.",
        drag(session(), 0, np.array([-0.10, -0.14, 0.08])),
        seconds=9.0,
    )
    yield Scene(
        "The cubes show the predicted error throughout the region. They follow the drag too.",
        (ShowCubes(CubeView(field=Field.PREDICTED)),),
        seconds=6.0,
    )
    yield Scene("", drag(session(), 5, np.array([0.12, 0.10, 0.06])), seconds=9.0)
    yield Scene(
        "Back to the best plate so far, with one button.", (RestoreBest(), ShowCubes(CubeView())), seconds=6.0
    )
    yield Scene(
        "A virtual arm with hidden manufacturing errors is measured, plus one effect that geometry "
        "can't explain.",
        (MeasureVirtualArm(SEED, surprise=True, more=POSES),),
        seconds=7.0,
    )
    yield Scene("Three algorithms identify its parameters …", (Identify(),), seconds=8.0)
    yield Scene(
        "The solid arm is nominal, the amber one calibrated; arrows show the errors, exaggerated.",
        tuple(ShowRow(row) for row in range(0, 40, 4)),
        seconds=12.0,
    )
    yield Scene(
        "The remaining error is not geometric. The diagnosis looks for the cause …",
        (Diagnose(),),
        seconds=8.0,
    )
    found = session().diagnosis
    if found is not None and found.effects:
        yield Scene(f"Found: {found.message}", seconds=8.0)
        yield Scene("The effect is added to the model …", (AddEffects(),), seconds=8.0)


def drag(session: Session, target: int, way: np.ndarray) -> tuple[AbstractCommand, ...]:
    """Moving a target along a way, there and half back."""
    start = session.plate.targets[target]
    roll, pitch, yaw = start.rpy.tolist()
    moves: list[AbstractCommand] = []
    for share in np.sin(np.linspace(0.0, 0.8 * np.pi, STEPS)):
        x, y, z = (start.xyz + share * way).tolist()
        moves.append(MoveTarget(target, (x, y, z), (roll, pitch, yaw), CLIENT))
    return (GrabTarget(target, CLIENT), *moves, DropTarget(CLIENT))

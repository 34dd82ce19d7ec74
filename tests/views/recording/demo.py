"""The session that `recordings/sample` shows.  Run: python tests/views/recording/demo.py recordings/sample

A plate is improved by dragging three of its targets, a virtual arm is measured on it, identified and looked
at: real commands through a real worker, recorded as every session is.
"""

import sys
import time
from pathlib import Path

import numpy as np

from workbench import load_plate, load_robot
from workbench.session import Session, Worker
from workbench.session.command import AbstractCommand
from workbench.session.commands.compare import SetOverlay, ShowFit, ShowRow
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.identify import Identify
from workbench.session.commands.plate import SetNoise
from workbench.session.commands.region import CHORES, ShowCubes
from workbench.session.commands.undo import Undo
from workbench.session.comparison import ModelStage, Overlay
from workbench.session.journal.folder import begin
from workbench.session.state import CubeView
from workbench.views.recording.recorder import recorder

STEPS, PAUSE = 12, 0.04
"""Places of a drag, and the time between two of them [s]."""


def drag(session: Session, target: int, by: tuple[float, float, float], turn: tuple[float, float, float]):
    """Commands that drag a target along and turn it."""
    begin = session.plate.targets[target]
    yield GrabTarget(target, 1)
    for share in np.linspace(0.0, 1.0, STEPS):
        xyz, rpy = (begin.xyz + share * np.array(by)).tolist(), (begin.rpy + share * np.array(turn)).tolist()
        yield MoveTarget(target, tuple(xyz), tuple(rpy), 1)
    yield DropTarget(1)


def commands(session: Session) -> list[AbstractCommand]:
    """What is done, in order."""
    return [
        ShowCubes(CubeView(field="predicted", cut=1, layer=5)),
        *drag(session, 0, (-0.06, 0.03, 0.05), (0.25, 0.1, 0.0)),
        *drag(session, 4, (0.05, -0.08, 0.04), (-0.2, 0.2, 0.3)),
        *drag(session, 7, (0.30, 0.20, 0.60), (0.0, 0.0, 0.0)),
        Undo(),
        SelectTarget(2),
        SetNoise(5e-5, 1.7e-4),
        MeasureVirtualArm(7, errors=(5e-4, 1e-3)),
        Identify(("ols", "opt2")),  # both converge quadratically: the same on every machine
        ShowFit("ols"),
        ShowFit("opt2"),
        SetOverlay(Overlay(stage=ModelStage.NOMINAL, exaggeration=60.0)),
        ShowRow(30),
    ]


def play(folder: Path, *, pause: float = PAUSE) -> Worker:
    """Record the session; the worker is closed."""
    begun = begin(load_robot("aria"), load_plate("table2"), folder=folder)
    keepers = (*begun.keepers, recorder(folder))
    worker = Worker(begun.session, keepers=keepers)
    worker.begin_chores(CHORES)
    for command in commands(begun.session):
        worker.submit(command)
        if not worker.wait(120.0):
            raise TimeoutError(command.title)
        time.sleep(pause)
    worker.close()
    return worker


if __name__ == "__main__":
    play(Path(sys.argv[1]))

"""The virtual arm of a guided measurement: moves in real time and sends samples, as a real arm does."""

import threading
from typing import final

import numpy as np

from workbench.base import se3
from workbench.data.live.sample import Sample
from workbench.data.simulation.driver import Pace, drive
from workbench.session.commands.measure import TakeSample
from workbench.session.guided import Ride, VirtualArm
from workbench.session.state import Session
from workbench.session.view import AbstractView
from workbench.session.worker import Worker

PACE = Pace(rate=20.0)
"""How the arm moves, and how often it is looked at."""


@final
class VirtualDriver(AbstractView):
    """Carries out the ways that the session asks for, each in a thread of its own; a new one ends the old.

    Args:
        worker: Whose session is watched, and who gets the samples.
        hurry: How many times faster than a real arm it goes.
    """

    def __init__(self, worker: Worker, *, hurry: float = 1.0):
        self._worker, self._hurry = worker, hurry
        self._ride = _ride(worker.session)
        self._stop = threading.Event()

    def draw(self, session: Session) -> None:
        ride = _ride(session)
        if ride is self._ride:
            return
        self.close()
        self._ride, self._stop = ride, threading.Event()
        if session.measuring is not None and session.measuring.virtual is not None and ride is not None:
            arguments = (session.measuring.virtual, ride, self._stop)
            threading.Thread(target=self._go, args=arguments, name="workbench-arm", daemon=True).start()

    def close(self) -> None:
        self._stop.set()

    def _go(self, arm: VirtualArm, ride: Ride, stop: threading.Event) -> None:
        samples = drive(
            arm.actual,
            ride.end[None],
            rng=np.random.default_rng([arm.seed, ride.number]),
            instrument=arm.instrument,
            pace=PACE,
            start=ride.start,
            clock=ride.clock,
        )
        for sample in samples:
            if stop.wait(1.0 / (PACE.rate * self._hurry)):
                return
            self._worker.submit(command_of(sample))


def _ride(session: Session) -> Ride | None:
    return None if session.measuring is None else session.measuring.ride


def command_of(sample: Sample) -> TakeSample:
    """The sample as a command; whether its row is stored is asked for on the page."""
    xyz = quat = None
    if sample.position is not None:
        x, y, z = sample.position.tolist()
        xyz = (x, y, z)
    if sample.rotation is not None:
        a, b, c, d = se3.matrix_to_quaternion(sample.rotation).tolist()
        quat = (a, b, c, d)
    return TakeSample(sample.time, tuple(sample.q.tolist()), xyz, quat)

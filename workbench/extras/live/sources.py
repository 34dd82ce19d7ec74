"""A live source: its samples become commands of the app."""

import threading
import time
from collections.abc import Iterable
from dataclasses import replace
from typing import final

import numpy as np

from workbench.extras.live.sample import samples
from workbench.extras.live.session import Measuring, Source, TakeSample, TellSource
from workbench.extras.live.standstill import StandstillDetector
from workbench.session.commands.messages import Tell
from workbench.session.state import Session
from workbench.session.view import AbstractView
from workbench.session.worker import Worker

RATE = 20.0
"""Samples that are passed on in a second, at most."""
SILENT = 2.0
"""A source without samples for this long counts as silent [s]."""


@final
class LiveSource(AbstractView):
    """One thread reads and judges standstill, another passes the newest sample on.

    Args:
        worker: Who gets the samples.
        lines: Of the source; their end is the source's.
        name: Of the source, for people.
    """

    def __init__(self, worker: Worker, lines: Iterable[str], *, name: str):
        self._worker, self._lines, self._name = worker, lines, name
        self._newest: TakeSample | None = None
        self._heard = time.monotonic()
        self._requested = -np.inf
        self._detector = StandstillDetector()
        self._mistakes = 0
        self._stop = threading.Event()
        worker.submit(TellSource(name))
        for work in (self._read, self._pass_on):
            threading.Thread(target=work, name="workbench-source", daemon=True).start()

    def draw(self, session: Session) -> None:
        """Nothing: it only tells."""

    def close(self) -> None:
        self._stop.set()

    def _read(self) -> None:
        for sample in samples(self._lines, source=self._name, on_error=lambda error: self._say(str(error))):
            if self._stop.is_set():
                return
            self._heard = time.monotonic()
            session, joints = self._worker.session, len(sample.q)
            if joints != session.robot.dof:
                both = f"has {joints} joints, but the robot here has {session.robot.dof}"
                self._say(f"the arm at {self._name} {both}; choose the robot that is connected")
                continue
            noise = session.noise.position, session.noise.rotation
            command = TakeSample(**sample.plain(), arm_state=self._detector.update(sample, noise))
            is_wanted = sample.capture and session.part(Measuring) is not None
            if is_wanted and self._heard - self._requested >= 1.0 / RATE:
                self._requested = self._heard
                self._worker.submit(command)
            else:
                self._newest = replace(command, capture=False)
        if not self._stop.is_set():
            self._stop.set()
            self._worker.submit(TellSource(self._name, is_open=False))

    def _say(self, text: str) -> None:
        """The first mistake of a source: the same one would come twenty times a second."""
        self._mistakes += 1
        if self._mistakes == 1:
            self._worker.submit(Tell(text))

    def _pass_on(self) -> None:
        is_silent = False
        while not self._stop.wait(1.0 / RATE):
            newest, self._newest = self._newest, None
            silence = time.monotonic() - self._heard
            if (silence > SILENT) is not is_silent:
                is_silent = silence > SILENT
                self._worker.submit(TellSource(self._name, silence=round(silence, 1) if is_silent else 0.0))
            if newest is not None:
                self._worker.submit(newest)


def end_former(worker: Worker) -> None:
    """Say that the source of a session that goes on is connected no more."""
    former = worker.session.part(Source)
    if former is not None and former.is_open:
        worker.submit(TellSource(former.name, is_open=False))

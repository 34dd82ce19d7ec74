"""A session of the built-in arm on its plate, worked out once."""

from dataclasses import dataclass, field
from functools import partial
from threading import Event

import pytest

from workbench import load_plate, load_robot
from workbench.session import AbstractView, Session, Worker, start


@dataclass
class Recorded(AbstractView):
    """A view that keeps every snapshot."""

    drawn: list[Session] = field(default_factory=list)
    closed: bool = False
    gate: Event | None = None

    def draw(self, session: Session) -> None:
        if self.gate is not None:
            self.gate.wait(60)
        self.drawn.append(session)

    def close(self) -> None:
        self.closed = True


@pytest.fixture(scope="session")
def first() -> Session:
    return start(load_robot("aria"), load_plate("table2"))


@pytest.fixture
def view() -> Recorded:
    return Recorded()


@pytest.fixture
def worker(first, view):
    running = Worker(first, views=[view])
    yield running
    running.close()


@pytest.fixture
def do(worker):
    """Carry commands out one after the other; returns the session afterwards."""

    return partial(carry_out, worker)


def carry_out(worker: Worker, *commands) -> Session:
    """The session after commands, each carried out before the next one."""
    for command in commands:
        worker.submit(command)
        assert worker.wait(120.0)
    return worker.session

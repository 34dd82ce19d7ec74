"""The session: plain data changed only by commands, owned by one worker, drawn by views."""

from workbench.session.command import AbstractChange, AbstractCommand, AbstractTask
from workbench.session.journal import Entry, replay
from workbench.session.start import start
from workbench.session.state import Session
from workbench.session.view import AbstractView
from workbench.session.worker import Worker

__all__ = [
    "AbstractChange",
    "AbstractCommand",
    "AbstractTask",
    "AbstractView",
    "Entry",
    "Session",
    "Worker",
    "replay",
    "start",
]

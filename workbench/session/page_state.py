"""What is under way, and messages: what stays with another arm."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

MESSAGES = 4
"""How many messages are kept for the panel."""


class Tab(StrEnum):
    """The tabs of the page, in their order."""

    ROBOT = "Robot"
    PLATE = "Plate"
    MEASURE = "Measure"
    CALIBRATE = "Calibrate"
    COMPARE = "Compare"
    EXPORT = "Export"


class Severity(StrEnum):
    """How a message is meant."""

    LOG = "log"
    """For the recording alone: the page shows the same elsewhere."""
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


PASSING = (Severity.LOG, Severity.INFO)
"""Over once the user goes on."""


@dataclass(frozen=True)
class Message:
    """One sentence for the user.

    Args:
        number: Counts up in a session, so that views can tell a new message from an old one.
        severity: How it is meant.
        text: What happened and what to do.
        refused: Kind of the command that was refused; empty if none was.
    """

    number: int
    severity: Severity
    text: str
    refused: str = ""


@dataclass(frozen=True)
class RunningJob:
    """Long work under way.

    Args:
        title: What it is.
        begun: When it began, by the clock of `time.monotonic` [s].
        fraction: Share done.
        since: When that was told, by the same clock [s].
        text: What it is doing.
        end: When it will end about, by the same clock, as far as that can be told; NaN where it can't.
        suspects: What may explain what is left at present, by name, and how much speaks for each.
    """

    title: str
    begun: float = math.nan
    fraction: float = 0.0
    since: float = math.nan
    text: str = ""
    end: float = math.nan
    suspects: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class PageState:
    """What stays with another arm: what is under way, and messages.

    Args:
        opened: How many times the program has opened a tab.
        tab: The tab that was opened last, by the program or by hand on any page; None: not known.
        only_shown: Why nothing can be changed; empty if it can.
        caption: What the demo says at present; empty if none plays.
        is_paused: Whether the demo waits.
        is_over: Whether it has said its last.
        chore: What is being worked out by the way; empty if nothing.
    """

    opened: int = 0
    tab: Tab | None = None
    only_shown: str = ""
    caption: str = ""
    is_paused: bool = False
    is_over: bool = False
    job: RunningJob | None = None
    chore: str = ""
    messages: tuple[Message, ...] = ()
    message_count: int = 0
    revision: int = 0

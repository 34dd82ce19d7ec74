"""Commands that keep poses of the jogged arm, and forget them."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

from workbench.base.errors import OptionError
from workbench.session.command import AbstractChange
from workbench.session.commands.arm import standing
from workbench.session.state import Session

MOST_CAPTURED = 200
"""Poses that are kept at most."""


@dataclass(frozen=True)
class CapturePose(AbstractChange):
    """Keep the joint positions at which the arm stands."""

    @property
    def title(self) -> str:
        return "Keep the pose"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        if len(session.captured) >= MOST_CAPTURED:
            raise OptionError(f"{MOST_CAPTURED} poses are kept already; save and forget them first")

    def apply(self, session: Session) -> Session:
        return replace(session, captured=(*session.captured, tuple(standing(session).tolist())))


@dataclass(frozen=True)
class ForgetPoses(AbstractChange):
    """Forget all kept poses."""

    @property
    def title(self) -> str:
        return "Forget the kept poses"

    @property
    def key(self) -> Hashable | None:
        return "forget poses"

    def check(self, session: Session) -> None:
        if not session.captured:
            raise OptionError("there are no kept poses to forget")

    def apply(self, session: Session) -> Session:
        return replace(session, captured=())

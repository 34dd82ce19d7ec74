"""Touches in a session: the command that finds a tool's tip or a user frame; what is kept and saved."""

from dataclasses import dataclass, field, replace
from typing import TypeVar, final

from workbench.arm.robot_toml import robot_text
from workbench.base.errors import DataError, OptionError
from workbench.extras.pendant.touching.tool_tip import ToolTip, tcp
from workbench.extras.pendant.touching.user_frame import UserFrame, frame
from workbench.session.command import AbstractTask, computed
from workbench.session.commands.data import MAX_FILE_BYTES, as_files, safe_name, too_large
from workbench.session.export import File, stem_of
from workbench.session.page_state import Severity
from workbench.session.part import AbstractPart
from workbench.session.state import Session

TIP, FRAME = "tool tip", "user frame"
Touched = TypeVar("Touched", ToolTip, UserFrame)


@final
@dataclass(frozen=True, eq=False)
class FoundTouched(AbstractPart):
    """What the last touches of each kind showed."""

    tip: ToolTip | None = None
    frame: UserFrame | None = None


class ReadTouches(AbstractTask[ToolTip | UserFrame]):
    """Find the tip of the tool, or a user frame, from touches.

    Args:
        name: Name of their file, of which only the ending counts.
        content: Joints at each touch, and in `contact` what was touched.
        what: `tool tip` or `user frame`.
        drawing: Name of the file of a drawing's points; empty for none.
        points: The drawing's points.
        radius: Of the ball that touches faces, for 3-2-1 [m].
    """

    name: str
    content: bytes = field(repr=False)
    what: str = TIP
    drawing: str = ""
    points: bytes = field(default=b"", repr=False)
    radius: float = 0.0

    title = computed(lambda self: f"Find the {self.what} from {safe_name(self.name)}")

    def check(self, session: Session) -> None:
        if self.what not in (TIP, FRAME):
            raise OptionError(f"touches show a {TIP} or a {FRAME}, got '{self.what}'")
        for name, content in ((self.name, self.content), (self.drawing, self.points)):
            if len(content) > MAX_FILE_BYTES:
                raise DataError(too_large(name, len(content), MAX_FILE_BYTES))

    def compute(self, session: Session) -> ToolTip | UserFrame:
        contents = {safe_name(self.name): self.content, f"cad-{safe_name(self.drawing)}": self.points}
        with as_files(contents) as (touches, points):
            if self.what == TIP:
                return tcp(session.robot, touches)
            tip = usable(touched_of(session).tip)
            arm = session.robot if tip is None else tip.robot
            found = frame(arm, touches, cad=points if self.drawing else None, radius=self.radius)
        own = ("the tool is the one found from earlier touches",) if tip is not None else ()
        return replace(found, notes=(*found.notes, *own))

    def finish(self, session: Session, result: ToolTip | UserFrame) -> Session:
        kept = touched_of(session)
        kept = FoundTouched(result) if isinstance(result, ToolTip) else replace(kept, frame=result)
        severity = Severity.WARNING if result.doubt else Severity.INFO
        return session.with_part(kept).with_message(severity, result.doubt or result.sentence)


def touched_of(session: Session) -> FoundTouched:
    """What the last touches of each kind showed."""
    return session.part(FoundTouched) or FoundTouched()


def usable(found: Touched | None) -> Touched | None:
    """What was found, if nothing speaks against it."""
    return None if found is None or found.doubt else found


def tool_toml(session: Session) -> File:
    if (found := usable(touched_of(session).tip)) is None:
        raise DataError("no tool tip has been found; give touches of one point first")
    return f"{stem_of(found.robot.name)}-tool.toml", robot_text(found.robot).encode()


def frame_toml(session: Session) -> File:
    if (found := usable(touched_of(session).frame)) is None:
        raise DataError("no user frame has been found; give its touches first")
    return "frame.toml", found.toml().encode()

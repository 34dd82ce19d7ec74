"""What a drag leaves in the journal: its grab, the last place, and its drop, however long it took.

The arm is followed from place to place. The last place therefore says from which posture the arm came to it,
and leads alone to the same session to the last digit.
"""

from dataclasses import replace

from workbench.session.command import AbstractChange
from workbench.session.commands import MoveTarget
from workbench.session.commands.drag import Posture
from workbench.session.journal.entry import Ending, Entry
from workbench.session.state import Session


def in_one(last: Entry, command: AbstractChange, session: Session) -> AbstractChange | None:
    """The command that does what the last one and this one did together; None where both are needed.

    Args:
        last: The last entry of the journal.
        command: The one that was carried out after it.
        session: The session between the two.
    """
    if last.ending is not Ending.DONE or not isinstance(command, MoveTarget):
        return None
    holder = session.holder
    if holder is None or (holder.client, holder.target) != (command.client, command.target):
        return None
    if not isinstance(last.command, MoveTarget) or last.command.key != command.key:
        return None
    return replace(command, start=Posture.of(session.states[command.target]))

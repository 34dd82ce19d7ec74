"""Recorded sessions that take one command after the other, and lines of theirs changed afterwards."""

import json

from session_at_work import carry_out

from workbench.session import Worker
from workbench.session.journal import codec
from workbench.session.journal.reader import JOURNAL


class Run:
    """A recorded session that takes one command after the other."""

    def __init__(self, begun):
        self.begun, self.folder = begun, begun.folder
        self.worker = Worker(
            begun.session, keepers=begun.keepers, journal=begun.entries, opening=begun.opening
        )

    def __call__(self, *commands):
        return carry_out(self.worker, *commands)

    @property
    def lines(self):
        return (self.folder / JOURNAL).read_bytes().splitlines()


def rewrite(folder, step, change):
    """Change a line as somebody would who knows the format."""
    path = folder / JOURNAL
    lines = path.read_text().splitlines()
    line = json.loads(lines[step])
    line.pop(codec.CHECK, None)
    change(line)
    lines[step] = codec.sealed(json.dumps(line, ensure_ascii=False))
    path.write_text("\n".join(lines) + "\n")
    return folder

"""The journal: every command with its outcome, in memory and in a folder that can be reopened.

A recording is a folder: `journal.jsonl` (a header, then one line a command), and `inputs/` with copies of the
robot, the plate and the measurement files. The journal is the truth; pictures are drawn from it.

It is plain text and no sqlite3 database: anyone can read, compare and copy it while it is written, whereas a
database that is being written is whole only together with its write-ahead log, and a copy of the file alone
lacks the last commands.
"""

from workbench.session.journal.replay import replay
from workbench.session.view import Ending, Entry

__all__ = ["Ending", "Entry", "replay"]

"""The journal: every command with what became of it, in memory and in a folder that can be opened again.

A recording is a folder: `journal.jsonl` (a header, then one line a command), and `inputs/` with copies of the
robot, the plate and the measurement files. The journal is the truth; pictures are drawn from it.
"""

from workbench.session.journal.entry import Ending, Entry
from workbench.session.journal.replay import replay

__all__ = ["Ending", "Entry", "replay"]

"""Commands that README and documentation show, run as they are typed."""

import re
import shlex
from collections.abc import Iterable


def run_lines(run, lines: Iterable[str]) -> None:
    """Every line as it is typed, each in this process."""
    for line in lines:
        program, *options = shlex.split(line, comments=True)
        assert program == "workbench"
        status, _, err = run(*options)
        assert status == 0, (line, err)


def unbroken(text: str) -> str:
    """A text whose lines that end in a backslash go on in the same line."""
    return text.replace("\\\n", "")


def commands(text: str) -> list[str]:
    """Lines of a text's shell blocks, without comments."""
    blocks = re.findall(r"```bash\n(.*?)```", unbroken(text), re.DOTALL)
    return [line for block in blocks for line in block.splitlines() if line.strip() and line[0] != "#"]

"""What is distributed: its name, its licence, and what texts tell people to install."""

import re
import shlex
import tomllib
from importlib.metadata import distribution
from pathlib import Path

from workbench.base.errors import MissingExtraError
from workbench.base.installed_package import NAME, install_command

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
KINDS = (".py", ".md", ".toml", ".html", ".ipynb", ".yml", ".yaml", ".rst", ".txt", ".cff", ".cfg")
TOLD = re.compile(
    r"\b(?:pip3?|pipx|uvx?|conda|mamba|poetry|pdm) (?:tool |pip )?(?:install|add|run|--from) [^\n`|]*"
)
RIGHT = re.compile(
    r"pip install (?:-q )?(?:-e )?(?:'\.\[(?:(?:{})(?:,|(?=\])))+\]'|\.|\{{checkout\}})(?![\w.]| workbench)"
    r"|uvx --from \. workbench".format("|".join(PROJECT["optional-dependencies"]))
)
"""The checkout, with extras that exist or without: `workbench` on an index is a stranger's."""


def texts():
    """Every text of the tree that people read, with its path."""
    tops = (".ci", ".github", "assets", "tests", "workbench")
    paths = [
        p for top in tops for p in (ROOT / top).rglob("*") if p.suffix in KINDS or p.parent.name == ".ci"
    ]
    for path in sorted({*paths, *ROOT.glob("*.md"), *ROOT.glob("*.toml")}):
        if path.is_file() and path != Path(__file__):
            yield path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")


def strangers(text: str) -> list[str]:
    """What a text tells to install that is not this checkout."""
    return [told for told in TOLD.findall(text) if not RIGHT.match(told)]


def test_texts_tell_to_install_this_checkout():
    wrong = {name: found for name, text in texts() if (found := strangers(text))}
    assert not wrong


def test_a_missing_extra_says_what_works_in_a_checkout():
    message = str(MissingExtraError("reading parquet files", extra="parquet"))
    assert message.endswith("pip install -e '.[parquet]' in the checkout")
    assert shlex.split(install_command("cad")) == ["pip", "install", "-e", ".[cad]"]


def test_the_program_is_the_only_entry_point():
    """Extras come in by their records: `workbench/parts.py`."""
    installed = [(e.group, e.name, e.value) for e in distribution(NAME).entry_points]
    assert installed == [("console_scripts", "workbench", "workbench.__main__:main")]
    assert "entry-points" not in PROJECT

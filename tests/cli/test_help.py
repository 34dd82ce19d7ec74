"""What the command says first: the help, and the three lines of a page that has begun."""

import re
import subprocess
import sys

import pytest

from workbench.cli import PANELS, add_plugins, app, serve
from workbench.cli.exit_status import SECTIONS
from workbench.cli.sessions import _with_recorder
from workbench.session.journal.folder import StartedSession
from workbench.views.page import serve as page

HEAVY = ("numpy", "scipy", "numba", "viser", "rerun", "matplotlib", "pint", "rich", "trimesh")


def test_commands_stand_under_what_one_wants(run):
    _, out, _ = run("--help")
    headings = [line[:-1] for line in out.splitlines() if re.fullmatch(r"\w+:", line)]
    assert headings == ["Options", *filter(headings.__contains__, SECTIONS)]  # one may be of extras alone
    assert set(PANELS) <= set(headings) <= {"Options", *SECTIONS}
    assert not re.search(r"^Commands:", out, re.M)  # an extra's command stands in a section too
    assert serve.__name__ in out


def groups():
    add_plugins(["--help"])
    return [str(group.name or group.typer_instance.info.name) for group in app.registered_groups]


@pytest.mark.parametrize("options", [(), *((group,) for group in groups())])
def test_no_sentence_is_cut_off(run, options):
    _, out, _ = run(*options, "--help")
    assert "..." not in out.partition("\n")[2]
    listed = out[out.rindex("--help") :]
    entries = re.split(r"\n {2}(?=[a-z])", listed)[1:]
    assert entries
    for entry in entries:
        assert re.sub(r"\n\w+:\s*$", "", entry).rstrip().endswith("."), entry


def test_start_and_help_load_nothing_heavy():
    code = (
        "import sys, workbench\n"
        "assert 'show' in dir(workbench)\n"
        "sys.argv = ['workbench', '--help']\n"
        "from workbench.cli import main\n"
        "try: main()\n"
        f"finally: print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_a_browser_is_opened_where_there_is_a_screen(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(page.sys, "platform", "linux")
    assert not page._has_browser()  # one for terminals would cover what is said
    monkeypatch.setenv("DISPLAY", ":0")
    assert page._has_browser()


def test_what_is_said_of_a_session(capsys):
    message = StartedSession(None, folder=None, trouble="no room")
    _with_recorder(message, None)
    assert [line.split(":")[0] for line in capsys.readouterr().out.splitlines()] == [
        "session",
        "to stop",
        "note",
    ]

"""What the command says first: the help, and the three lines of a page that has begun."""

import re
import subprocess
import sys

from workbench.cli import PANELS, app, serve
from workbench.cli.exit_status import SECTIONS
from workbench.views.page import serve as page

HEAVY = ("numpy", "scipy", "numba", "viser", "rerun", "matplotlib", "pint", "rich", "trimesh")


def test_commands_stand_under_what_one_wants(run):
    _, out, _ = run("--help")
    headings = [line[:-1] for line in out.splitlines() if re.fullmatch(r"\w+:", line)]
    assert headings == ["Options", *filter(headings.__contains__, SECTIONS)]  # one may be of extras alone
    assert set(PANELS) <= set(headings) <= {"Options", *SECTIONS}
    assert not re.search(r"^Commands:", out, re.M)  # an extra's command stands in a section too
    assert serve.__name__ in out


def test_every_command_writes_its_result_where_json_says(run, built):
    groups = [("", built(app))]
    for group, commands in groups:
        for name, command in commands.whole.commands.items():
            if hasattr(command, "commands"):
                groups.append((name, command))
            else:
                assert "--json" in run(*group.split(), name, "--help")[1], name


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

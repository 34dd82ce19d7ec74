"""How commands end: the exit status, and one sentence for whatever happens."""

import json
import subprocess
import sys
from types import SimpleNamespace

import pytest

from workbench.__main__ import main
from workbench.cli.exit_status import run as ended

HELP = [sys.executable, "-m", "workbench", "--help"]


def raising(error: BaseException):
    def command(words):
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "status", "sentence"),
    [
        (KeyboardInterrupt(), 130, "workbench: stopped\n"),
        (MemoryError(), 1, "workbench: there is not enough memory"),
        (RecursionError(), 1, "workbench: the input has too many levels"),
        (OSError(28, "No space left on device", "out.json"), 1, "workbench: out.json: No space left"),
    ],
)
def test_what_is_raised_is_said(error, status, sentence, capsys):
    assert ended(raising(error), []) == status
    assert capsys.readouterr().err.startswith(sentence)


def test_a_bug_is_shown_as_one():
    with pytest.raises(ZeroDivisionError):
        ended(raising(ZeroDivisionError()), [])


def test_an_interrupted_command_says_so(run, monkeypatch):
    from workbench.arm import built_in_arms

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(built_in_arms, "load_robot", interrupted)
    status, _, errors = run("redundancy", "--robot", "aria")
    assert (status, errors) == (130, "workbench: stopped\n")


def test_an_interrupt_while_the_commands_are_read_says_so(monkeypatch, capsys):
    def interrupted(name, *_, **__):
        raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "workbench.cli")
    monkeypatch.setattr(sys, "meta_path", [SimpleNamespace(find_spec=interrupted)])
    with pytest.raises(SystemExit, match="130"):
        main()
    assert capsys.readouterr().err == "workbench: stopped\n"


def test_a_closed_pipe_is_no_mistake():
    with subprocess.Popen(HELP, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as program:
        program.stdout.close()
        errors = program.stderr.read()
    assert (program.returncode, errors) == (0, b"")


def test_a_full_device_is_one_sentence():
    with open("/dev/full", "wb") as full:
        done = subprocess.run(HELP, stdout=full, stderr=subprocess.PIPE, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        b"workbench: No space left on device; make room, or choose another place"
    ]


def test_a_locale_without_our_letters():
    environment = {
        "PYTHONUTF8": "0",
        "LC_ALL": "POSIX",
        "PYTHONCOERCECLOCALE": "0",
        "PYTHONIOENCODING": "ascii",
    }
    code = "from workbench.cli.exit_status import run; run(lambda words: print('0.1' + chr(176)), [])"
    path = {"PYTHONPATH": ":".join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment | path, capture_output=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, b"0.1?\n", b"")


def test_a_result_on_standard_output_is_alone_there(run, tmp_path):
    run("simulate", "--robot", "aria", "--poses", "10", "--out", "rows.csv")
    status, out, errors = run("evaluate", "rows.csv", "--robot", "aria", "--json", "-")
    assert status == 0
    assert json.loads(out)["schema"] == "workbench.evaluation/1"
    assert "rows" in errors
    assert [path.name for path in tmp_path.iterdir()] == ["rows.csv"]

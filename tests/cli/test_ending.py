"""How commands end: the exit status, and one sentence for whatever happens."""

import json
import subprocess
import sys

import pytest
from other_process import commands
from slow import slow

from workbench.cli.exit_status import run as ended

HELP = [sys.executable, "-m", "workbench", "--help"]


def raising(error: BaseException):
    def command(text):
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "status", "sentence"),
    [
        (KeyboardInterrupt(), 130, "workbench: stopped\n"),
        (MemoryError(), 1, "workbench: out of memory"),
        (RecursionError(), 1, "workbench: the input is nested"),
        (OSError(28, "No space left on device", "out.json"), 1, "workbench: out.json: No space left"),
    ],
)
def test_what_is_raised_is_said(error, status, sentence, capsys):
    assert ended(raising(error), []) == status
    assert capsys.readouterr().err.startswith(sentence)


def test_a_closed_pipe_is_no_mistake():
    with subprocess.Popen(HELP, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as program:
        program.stdout.close()
        errors = program.stderr.read()
    assert (program.returncode, errors) == (0, b"")


def test_a_full_device_is_one_sentence():
    with open("/dev/full", "wb") as full:
        done = subprocess.run(HELP, stdout=full, stderr=subprocess.PIPE, check=False)
    assert done.returncode == 1
    assert done.stderr == b"workbench: No space left on device; make room, or choose another place\n"


def test_a_result_on_standard_output_is_alone_there(run, tmp_path):
    run("simulate", "--robot", "aria", "--poses", "10", "--out", "rows.csv")
    status, out, errors = run("evaluate", "rows.csv", "--robot", "aria", "--json", "-")
    assert status == 0
    assert json.loads(out)["schema"] == "workbench.evaluation/1"
    assert "rows" in errors
    assert [path.name for path in tmp_path.iterdir()] == ["rows.csv"]


@pytest.mark.parametrize(
    ("command", "status"),
    [
        ("--help", 0),
        ("plate score table2 --robot aria", 0),
        ("evaluate none.csv --robot aria", 1),
        ("evaluate fresh.csv --robot panda", 1),
        ("soft.cvs", 1),
        ("fly", 64),
        ("evaluate", 64),
        ("plate", 64),
        ("evaluate fresh.csv --robot aria --fly", 64),
        ("simulate --robot aria --out d.csv --poses many", 64),
        ("identify fresh.csv --robot aria --held-out 120%", 64),
    ],
)
def test_the_status_tells_wrong_usage_from_no_result_and_from_a_bad_one(command, status, run):
    run("simulate", "--robot", "aria", "--poses", "10", "--out", "fresh.csv")
    found, out, err = run(*command.split())
    assert found == status, err
    assert bool(err) == (status != 0)
    assert bool(out) == (status in (0, 2))


SIMULATED = "simulate --robot aria --poses 30 --seed 1 --out rows.csv"
IDENTIFIED = "identify rows.csv --robot aria --algorithm ols --save arm.toml"
HOSTILE = {
    "German, no home": {
        "HOME": "/dev/null",
        "XDG_CACHE_HOME": "/dev/null/c",
        "XDG_CONFIG_HOME": "/dev/null/d",
        "LC_ALL": "de_DE.UTF-8",
        "LANG": "de_DE.UTF-8",
    },
    "plain": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
}


def files(folder) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize("name", [slow(n) if n == "plain" else n for n in HOSTILE])
def test_files_are_the_same_whatever_the_home_and_the_locale(name, run, tmp_path):
    assert [run(*line.split())[::2] for line in (SIMULATED, IDENTIFIED)] == [(0, ""), (0, "")]
    (folder := tmp_path / "other").mkdir()
    found = commands(SIMULATED, IDENTIFIED, folder=folder, **HOSTILE[name])
    assert [(end.status, end.err) for end in found] == [(0, ""), (0, "")]
    assert files(folder) == files(tmp_path)

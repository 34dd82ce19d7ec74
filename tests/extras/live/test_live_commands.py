"""A virtual arm is driven, captured and identified; what these commands refuse."""

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from refusals import mentions

from workbench import cli
from workbench.data.readers import read_measurements
from workbench.plate.plate_toml import load_plate


def test_a_driven_arm_is_captured_and_identified(run):
    """The line of the README: drive | capture, then identify, with real processes for the pipe."""
    program = [sys.executable, "-m", "workbench"]
    where = ["--robot", "aria", "--plate", "table2"]
    environment = os.environ | {"PYTHONPATH": str(Path(cli.__file__).parents[2])}
    driver = subprocess.Popen(
        [*program, "drive", *where, "--speed", "0", "--rate", "20"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
    )
    taken = subprocess.run(
        [*program, "capture", *where, "--from", "-", "--out", "d.csv"],
        stdin=driver.stdout,
        capture_output=True,
        text=True,
        env=environment,
        timeout=120,
        start_new_session=True,  # no terminal: only the source's own requests store
    )
    driver.stdout.close()
    with driver.stderr as message:
        assert message.read() == b""
    assert (taken.returncode, driver.wait(60)) == (0, 0), taken.stderr
    assert taken.stderr.splitlines()[1] == "target 1 stored"
    assert len(read_measurements("d.csv", joints=6)) == 10
    status, _, _ = run("identify", "d.csv", "--robot", "aria", "--json", "r.json")
    assert status == 0
    assert json.loads(Path("r.json").read_text())["algorithms"]["opt2"]["converged"]


def test_an_incomplete_capture_says_so_by_its_status(run, monkeypatch):
    first = load_plate("table2").targets[0].xyz.tolist()
    line = {"time": 0.0, "q": [0, 0, 0, 0, 0, 0], "xyz": first, "capture": True}
    monkeypatch.setattr(sys, "stdin", io.StringIO(f"{json.dumps(line)}\n"))
    status, out, _ = run("capture", "--robot", "aria", "--plate", "table2", "--out", "d.csv")
    assert status == 2
    assert out.startswith("1 of 10 targets")
    assert len(read_measurements("d.csv", joints=6)) == 1


def test_a_capture_books_nothing_for_a_target_where_the_tool_is_not(run, monkeypatch):
    fourth = load_plate("table2").targets[3].xyz.tolist()
    line = {"time": 0.0, "q": [0, 0, 0, 0, 0, 0], "xyz": fourth, "capture": True}
    monkeypatch.setattr(sys, "stdin", io.StringIO(f"{json.dumps(line)}\n"))
    status, _, message = run("capture", "--robot", "aria", "--plate", "table2", "--out", "d.csv")
    assert status != 0
    assert mentions(message, "target 4")
    assert not Path("d.csv").exists()


REFUSED = {
    "unknown source": (
        ["capture", "--robot", "aria", "--plate", "table2", "--out", "d.csv", "--from", "nowhere"],
        ["nowhere", "host:port"],
    ),
    "silent source": (
        ["capture", "--robot", "aria", "--plate", "table2", "--out", "d.csv", "--from", "localhost:1"],
        ["localhost:1"],
    ),
    "open to the network": (
        ["capture", "--robot", "aria", "--plate", "table2", "--out", "d.csv", "--from", "listen:0.0.0.0:0"],
        ["0.0.0.0"],
    ),
    "unwritable capture": (
        ["capture", "--robot", "aria", "--plate", "table2", "--out", "/proc/nowhere/d.csv"],
        ["/proc/nowhere/d.csv"],
    ),
    "slow driver": (["drive", "--robot", "aria", "--plate", "table2", "--rate", "0"], ["rate"]),
    "backward driver": (["drive", "--robot", "aria", "--plate", "table2", "--speed", "-1"], ["speed"]),
    "blind driver": (
        ["drive", "--robot", "aria", "--plate", "table2", "--instrument", "ball-bar"],
        ["ball-bar"],
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_live_commands_refuse(refused, case):
    command, text = REFUSED[case]
    refused(text, *command)

"""A reader that closes the pipe costs no file: every command writes all of them before it prints anything."""

import json
from pathlib import Path

import numpy as np
import pytest

import workbench as wb
from workbench.parts import offered

WRITTEN = ("--out", "--save", "--json", "--report", "--actual", "--readings")
WRITTEN += ("--urdf", "--toml", "--controller")
"""Options that name an output."""

COMMANDS = (
    "simulate --robot aria --poses 5 --out out.csv --actual arm.toml",
    "identify rows.csv --robot aria --algorithm ols --save cal.toml",
    "diagnose rows.csv --robot aria --save cal.toml",
    "evaluate rows.csv --robot aria",
    "export given.toml --urdf a.urdf --toml a.toml --controller c.json --nominal aria",
    "plate score table2 --robot aria",
)
OF_EXTRAS = {
    "new": "aria --poses typed.csv --out own.toml",
    "poses": "--robot aria --number 6 --index O1 --out q.csv",
    "compensate": "circle.csv --robot given.toml --nominal aria --out q.csv",
    "plate export": "table2 --formats csv --out out",
    "plate yield": "table2 --robot aria --arms 20 --poses 20",
}
COMMANDS += tuple(f"{name} {OF_EXTRAS[name]}" for name, *_ in offered("commands") if name in OF_EXTRAS)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory) -> Path:
    """Rows of a virtual arm, its calibration, a circle."""
    folder = tmp_path_factory.mktemp("inputs")
    robot = wb.load_robot("aria")
    rows = wb.measure_poses(robot, 40, seed=1)[1]
    given = wb.identify(robot, rows, algorithms=("ols",), held_out=0.0).robot
    given.save(folder / "given.toml")
    wb.write_measurements(rows, folder / "rows.csv")
    wb.write_measurements(wb.measure_poses(robot, 4, actual=robot)[1], folder / "typed.csv")
    q = np.linspace([0.1, -0.4, 0.5, 0.2, 0.4, 0.1], [0.3, -0.5, 0.6, 0.3, 0.5, 0.2], 5)
    wb.write_measurements(wb.Dataset(q, time=np.arange(5.0)), folder / "circle.csv")
    return folder


@pytest.mark.parametrize("command", COMMANDS, ids=lambda options: " ".join(options.split()[:2]))
def test_every_file_is_there_though_nobody_reads(command, inputs, run_unread, tmp_path):
    for path in inputs.iterdir():
        (tmp_path / path.name).symlink_to(path)
    options = [*command.split(), "--json", "r.json"]
    status, _, err = run_unread(*options)
    assert status == 0, err
    outputs = [tmp_path / options[k + 1] for k, word in enumerate(options) if word in WRITTEN]
    assert all(path.exists() for path in outputs)
    assert json.loads((tmp_path / "r.json").read_text())["schema"].startswith("workbench.")

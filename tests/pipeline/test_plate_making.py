"""A folder with everything to make a plate, and the accuracy that its sheet promises."""

import numpy as np
import pytest

from workbench.design.plate_toml import load_plate
from workbench.errors import OptionError
from workbench.measure.instruments import INSTRUMENTS
from workbench.measure.simulate import simulate, virtual_arm
from workbench.model.forward import tool_poses
from workbench.pipeline import identify
from workbench.pipeline.plate_making import Format, expected_accuracy, export_plate, formats_named
from workbench.pipeline.simulation import region_goal
from workbench.robots import load_robot


@pytest.fixture(scope="module")
def aria():
    return load_robot("aria")


@pytest.fixture(scope="module")
def expected(aria):
    return expected_accuracy(aria, load_plate("table2"))


def test_every_format_is_written(tmp_path, aria):
    (tmp_path / "mine.txt").write_text("stays")
    fixture, files = export_plate(load_plate("table2"), tmp_path, formats=tuple(Format), robot=aria)
    names = {path.name for path in files}
    assert names == {
        *("plate.stl", "block-A.stl", "block-B.stl", "fixture.3mf", "plate.dxf", "holes.csv", "blocks.csv"),
        *("targets.csv", "plate.step", "block-A.step", "block-B.step", "sheet.html", "sheet.pdf"),
    }
    assert {path.name for path in tmp_path.iterdir()} == names | {"mine.txt"}
    page = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    assert "0.1" in page
    assert "wrist flip" in page
    assert (tmp_path / "sheet.pdf").read_bytes().count(b"/Type /Page ") == 1
    assert len(fixture.blocks) == 10


def test_nothing_is_written_where_it_can_not_be_made(tmp_path):
    plate = load_plate("table2")
    from dataclasses import replace

    with pytest.raises(OptionError):
        export_plate(replace(plate, size=np.array([0.3, 0.3, 0.01])), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_formats_are_named():
    assert formats_named("stl, DXF") == (Format.STL, Format.DXF)
    with pytest.raises(OptionError):
        formats_named("stl,obj")
    with pytest.raises(OptionError):
        formats_named("")


def test_the_promised_accuracy_is_met_by_virtual_arms(aria, expected):
    """Mean error over the region of 24 arms calibrated on the plate, against the sheet's number."""
    plate = load_plate("table2")
    goal = region_goal(aria, plate)
    solved = {b: i for i, b in enumerate(expected.branches)}
    assert len(solved) > 1
    errors = []
    for seed in range(24):
        rng = np.random.default_rng(seed)
        arm = virtual_arm(aria, rng=rng, length=2e-4, angle=2e-3)
        q = _postures(aria, plate, expected)
        rows = simulate(arm, q, instrument=INSTRUMENTS["plate"], rng=rng)
        found = identify(aria, rows, held_out=0.0, algorithm="ols").runs["ols"].calibrated
        miss = tool_poses(found, goal)[:, :3, 3] - tool_poses(arm, goal)[:, :3, 3]
        errors.append(np.linalg.norm(miss, axis=1).mean())
    mean, spread = np.mean(errors), np.std(errors) / np.sqrt(len(errors))
    assert abs(mean - expected.error.position_mean) < 3.5 * spread


def _postures(aria, plate, expected):
    from workbench.design.branches import plate_solutions

    found = plate_solutions(aria, plate)
    return np.stack(
        [next(b.q for b in bs if b.name == name) for bs, name in zip(found, expected.branches, strict=True)]
    )


def test_how_well_targets_are_known_counts(aria, expected):
    """Targets three times as uncertain make the arm three times as uncertain."""
    from dataclasses import replace

    plate = load_plate("table2")
    own = tuple(np.sqrt(8.0) * np.array(expected.sigma))
    worse = replace(plate, targets=tuple(
        replace(t, sigma=own, branch=b) for t, b in zip(plate.targets, expected.branches, strict=True)))  # fmt: skip
    assert np.isclose(
        expected_accuracy(aria, worse).error.position_mean, 3.0 * expected.error.position_mean, rtol=1e-9
    )

"""Targets round-trip exactly; a measured plate replaces the drawn one and says so."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

from workbench.base.errors import WorkbenchError
from workbench.extras.workshop.as_measured import PlateFrame, as_measured
from workbench.extras.workshop.outputs import targets_csv
from workbench.plate.measured_plate import UNCERTAINTY, load_plate, read_measured_targets
from workbench.plate.measured_plate import load_plate as load_toml
from workbench.plate.plate import Kind
from workbench.plate.tolerances import Production


def write(tmp_path, text, name="cmm.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_targets_round_trip(made_plate, tmp_path):
    measured = read_measured_targets(write(tmp_path, targets_csv(made_plate)))
    assert measured.numbers == tuple(range(1, len(made_plate) + 1))
    assert np.allclose(measured.poses, made_plate.poses, atol=1e-13)
    back = as_measured(made_plate, measured)
    assert np.allclose(back.poses, made_plate.poses, atol=1e-13)
    assert [t.kind for t in back.targets] == [t.kind for t in made_plate.targets]
    assert [t.branch for t in back.targets] == [t.branch for t in made_plate.targets]
    assert back.region is made_plate.region


def test_a_machine_of_another_country(tmp_path):
    """Semicolons, decimal commas, two of ten targets, in the plate's frame, with deviations known by hand."""
    nominal = load_toml("table2")
    shift = np.array([2e-4, -1e-4, 3e-4])
    rows = ["target;x[mm];y[mm];z[mm];sigma_x[mm];sigma_y[mm];sigma_z[mm]"]
    for number in (7, 2):
        x, y, z = 1e3 * (nominal.targets[number - 1].xyz - nominal.xyz + shift)
        rows.append(f"{number};{x:.4f};{y:.4f};{z:.4f};0,003;0,004;0,005".replace(".", ","))
    measured = read_measured_targets(write(tmp_path, "\n".join(rows)))
    plate = as_measured(nominal, measured, frame=PlateFrame.PLATE)
    for number, (old, new) in enumerate(zip(nominal.targets, plate.targets, strict=True), start=1):
        moved = shift if number in (2, 7) else np.zeros(3)
        assert np.allclose(new.xyz - old.xyz, moved, atol=1e-9)
        assert np.allclose(new.pose[:3, :3], old.pose[:3, :3], atol=1e-12)
    assert np.isclose(plate.targets[6].sigma[0], np.sqrt((9 + 16 + 25) / 3) * 1e-6)
    assert np.isclose(plate.targets[6].sigma[1], 0.0)
    text = " ".join(plate.notes)
    assert mentions(text, "0.374 mm")
    assert mentions(text, "1, 3, 4, 5, 6, 8, 9, 10")


def test_measured_targets_are_known_as_well_as_the_machine_knows_them(tmp_path):
    """Whatever tolerance they were made with; where only places were measured, their turns keep it."""
    made = Production(tolerance=(5e-5, 1e-3), play=(1e-5, 1e-3))
    drawn = replace(load_toml("table2"), production=made)
    nominal = replace(drawn, targets=tuple(replace(t, sigma=(1e-3, 1e-2)) for t in drawn.targets))
    path = write(tmp_path, targets_csv(nominal))
    plate = as_measured(nominal, read_measured_targets(path))
    assert np.allclose(plate.known, UNCERTAINTY)
    assert mentions(" ".join(plate.notes), "0.005 mm, 0.01°")
    assert np.allclose(np.hypot(plate.known, plate.play), np.hypot(UNCERTAINTY, made.play_sigma))
    plate = as_measured(nominal, read_measured_targets(path, uncertainty=(1e-6, 1e-5)))
    assert np.allclose(plate.known, (1e-6, 1e-5))
    places = "\n".join(",".join(line.split(",")[:4]) for line in path.read_text().splitlines())
    plate = as_measured(drawn, read_measured_targets(write(tmp_path, places)))
    assert np.allclose(plate.known, [[UNCERTAINTY[0], 1e-3 / np.sqrt(3.0)]] * 10)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x[mm],y[mm],z[mm]\n1,2,3\n", ("target",)),
        ("target,x[mm],y[mm],z[mm]\n1,1,2,3\n1,1,2,3\n", ("line 3", "twice")),
        ("target,x[mm],y[mm],z[mm]\n0,1,2,3\n", ("line 2", "number the targets from 1")),
        ("target,x[mm],y[mm]\n1,1,2\n", ("z[mm]",)),
        ("target,x[mm],y[mm],z[mm]\n1,1,2,\n", ("target 1", "no place")),
        ("target,x[mm],y[mm],z[mm]\n11,566,354,235\n", ("target 11", "has 10")),
        ("target,x[mm],y[mm],z[mm]\n1,250,0,50\n", ("target 1", "--frame plate")),
        ("target,x[m],y[m],z[m]\n1,566,354,235\n", ("target 1", "units")),
        ("target,x,y,z\n1,566,354,235\n", ("line 1", "unit is missing")),
    ],
)
def test_mistakes_are_named(text, message, tmp_path):
    with pytest.raises(WorkbenchError) as error:
        as_measured(load_toml("table2"), read_measured_targets(write(tmp_path, text)))
    assert all(word in str(error.value) for word in message), str(error.value)


def test_a_plate_is_made_and_comes_back_as_measured(run, told, tmp_path):
    """The nominal list, moved by 0.1 mm, is what the measuring machine says; every --plate takes it."""
    status, out, _ = run("plate", "export", "table2", "--out", "made", "--formats", "csv,dxf")
    assert status == 0
    assert mentions(out, "10", "5 × A, 5 × B")
    lines = (tmp_path / "made" / "targets.csv").read_text().splitlines()
    moved = [line.split(",") for line in lines[1:]]
    text = [",".join([n, str(float(x) + 0.1), *rest]) for n, x, *rest in moved]
    (tmp_path / "cmm.csv").write_text("\n".join([lines[0], *text]))
    found, out = told("plate", "as-measured", "table2", "cmm.csv", "--out", "real.toml")
    assert mentions(out, "0.100 mm")
    real = load_plate(tmp_path / "real.toml")
    assert np.allclose([t["xyz"] for t in found["targets"]], [t.xyz for t in real.targets])
    options = ("simulate", "--robot", "aria", "--plate", "cmm.csv", "--out", "rows.csv")
    assert run(*options)[0] == 0


def test_any_plate_option_takes_the_list_alone(tmp_path, made_plate):
    found = load_plate(write(tmp_path, targets_csv(made_plate)))
    assert np.allclose(found.poses, made_plate.poses, atol=1e-13)
    assert found.region.contains(found.poses[:, :3, 3]).all()
    assert "bounding box" in found.notes[0]
    points = "target,x[mm],y[mm],z[mm]\n2,0,0,100\n1,50,0,100\n"
    sockets = load_plate(write(tmp_path, points))
    assert [t.kind for t in sockets.targets] == [Kind.SOCKET] * 2
    assert np.allclose(sockets.targets[0].xyz, [0.05, 0.0, 0.1])

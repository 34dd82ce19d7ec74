"""Rows without a measured position take part in no position error: a table of points and inclinometers mixed.

The arm, its measurements and every expected number are computed here with numpy alone.
"""

import json
import tomllib

import numpy as np
import pytest
from points_and_tilts import DH, hidden, points, robot_file, upwards, write_mixed, write_rows


def test_evaluate_reports_the_measured_positions_alone(told, tmp_path):
    q, xyz, tilt = write_mixed(tmp_path)
    found, out = told("evaluate", "mixed.csv", "--robot", "arm.toml")
    off = 1e3 * np.linalg.norm(points(DH, q) - xyz, axis=1)[:10]
    for name, value in (("mean", off.mean()), ("rms", np.sqrt((off**2).mean())), ("max", off.max())):
        assert found["errors"]["position_mm"][name] == pytest.approx(value, rel=1e-6)
        assert f"{value:.3f}" in out
    assert found["errors"]["orientation_deg"] is None  # the tool's; nobody measured it
    assert [row["position_mm"] is None for row in found["rows"]] == [False] * 10 + [True] * 30
    u, (about_x, about_y) = upwards(DH, q), tilt.T
    level = np.cos(about_y)
    seen = np.stack([-np.sin(about_y), level * np.sin(about_x), level * np.cos(about_x)], 1)
    angle = np.rad2deg(np.linalg.norm(np.cross(seen, u), axis=1))[10:]
    assert found["errors"]["tilt_deg"]["rms"] == pytest.approx(np.sqrt((angle**2).mean()), rel=1e-6)


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_fit_reports_the_held_out_points_alone(command, told, tmp_path):
    """Held out: 15 points and 15 inclinometer rows; the mean is recomputed from the saved file."""
    made = hidden(1e-3, seed=5)
    write_rows(tmp_path / "fit.csv", made, seen=60, tilted=20, seed=1, noise=1e-4)
    q, xyz, _ = write_rows(tmp_path / "held.csv", made, seen=15, tilted=15, seed=2, noise=2e-4)
    robot_file(tmp_path / "arm.toml")
    options = ("fit.csv", "--robot", "arm.toml", "--held-out", "held.csv", "--noise", "0.1mm,0.001deg")
    options += ("--algorithm", "ols") if command == "identify" else ()
    found, _ = told(command, *options, "--save", "cal.toml", "--report", "out")
    saved = tomllib.loads((tmp_path / "cal.toml").read_text())
    dh = np.array([[joint[name] for name in ("theta", "d", "a", "alpha")] for joint in saved["joint"]])
    off = 1e3 * np.linalg.norm(points(dh, q) - xyz, axis=1)[:15]
    nominal = 1e3 * np.linalg.norm(points(DH, q) - xyz, axis=1)[:15]
    after = found["after"] if command == "diagnose" else found["algorithms"]["ols"]
    assert not saved.get("effect")
    assert after["held_out"]["position_mm"]["mean"] == pytest.approx(off.mean(), rel=1e-3)
    assert found["nominal"]["held_out"]["position_mm"]["mean"] == pytest.approx(nominal.mean(), rel=1e-6)
    assert after["held_out"]["orientation_deg"] is None


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_fit_of_inclinometers_alone_reports_their_angles(command, run, tmp_path):
    """No position anywhere: neither a number nor a picture of one, in any of the outputs."""
    write_rows(tmp_path / "tilts.csv", hidden(1e-3), seen=0, tilted=60, seed=1)
    robot_file(tmp_path / "arm.toml")
    _, out, err = run(
        *(command, "tilts.csv", "--robot", "arm.toml", "--json", "r.json", "--report", "out"),
        *("--noise", "0.1mm,0.001deg"),
    )
    assert (tmp_path / "r.json").is_file(), err
    found = json.loads((tmp_path / "r.json").read_text())
    run_of = found["algorithms"]["ols"] if command == "identify" else found["after"]
    for errors in (found["nominal"]["held_out"], run_of["held_out"]):
        assert errors["position_mm"] is None
        assert errors["tilt_deg"]["mean"] > 0.0
    assert run_of["held_out"]["tilt_deg"]["mean"] < 0.1 * found["nominal"]["held_out"]["tilt_deg"]["mean"]
    assert "nan" not in out.lower()
    pages = [path.read_text() for path in (tmp_path / "out").glob("*.html")]
    assert pages
    assert "nan mm" not in " ".join(pages)

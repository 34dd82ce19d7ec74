"""Rows without a measured position take part in no position error: a table of points and inclinometers mixed.

The arm, its measurements and every expected number are computed here with numpy alone.
"""

import csv
import json
import tomllib

import numpy as np
import pytest

import workbench as wb
from workbench.base.errors import DataError
from workbench.data.accuracy_requirement import Wanted
from workbench.identification.verification.certificate import write_certificate
from workbench.session import Worker, start
from workbench.session.commands.data import LoadData
from workbench.session.commands.identify import Identify
from workbench.session.guide import guide
from workbench.session.journal.numbers import changed_numbers
from workbench.views.page.panels.result_card import result_card

DH = np.array(  # theta, d, a, alpha of a UR5 [rad, m]
    [
        [0.0, 0.089159, 0.0, np.pi / 2],
        [0.0, 0.0, -0.425, 0.0],
        [0.0, 0.0, -0.39225, 0.0],
        [0.0, 0.10915, 0.0, np.pi / 2],
        [0.0, 0.09465, 0.0, -np.pi / 2],
        [0.0, 0.0823, 0.0, 0.0],
    ]
)
LINK = 3
"""The link that carries the inclinometer."""
TOOL = np.array([0.02, -0.03, 0.12])


def frames(dh, q):
    """Frames after every joint, standard DH."""
    out, here = [], np.tile(np.eye(4), (len(q), 1, 1))
    for (theta, d, a, alpha), angle in zip(dh, q.T, strict=True):
        c, s, ca, sa = np.cos(angle + theta), np.sin(angle + theta), np.cos(alpha), np.sin(alpha)
        step = np.zeros((len(q), 4, 4))
        step[:, 0] = np.stack([c, -s * ca, s * sa, a * c], 1)
        step[:, 1] = np.stack([s, c * ca, -c * sa, a * s], 1)
        step[:, 2] = [0.0, sa, ca, d]
        step[:, 3, 3] = 1.0
        here = here @ step
        out.append(here)
    return out


def points(dh, q, tool=TOOL):
    last = frames(dh, q)[-1]
    return last[:, :3, :3] @ tool + last[:, :3, 3]


def upwards(dh, q):
    """The direction upwards in the axes of the link."""
    return frames(dh, q)[LINK - 1][:, 2, :3]


def hidden(size, seed=0):
    """An arm that was made a little wrong."""
    return DH + size * np.random.default_rng(seed).normal(size=DH.shape)


def write_rows(path, dh, *, seen, tilted, seed, noise=0.0):
    """A table whose first rows have a point and whose other rows have an inclinometer's reading alone."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.5, 1.5, (seen + tilted, 6)) - [0, 1.0, 0, 0, 0, 0]
    xyz = points(dh, q) + noise * rng.normal(size=(len(q), 3))
    u = upwards(dh, q) + 1e-5 * rng.normal(size=(len(q), 3))
    tilt = np.stack([np.arctan2(u[:, 1], u[:, 2]), np.arctan2(-u[:, 0], np.hypot(u[:, 1], u[:, 2]))], 1)
    heads = [f"q{i}[rad]" for i in range(1, 7)] + ["x[m]", "y[m]", "z[m]"]
    with path.open("w", newline="") as file:
        write = csv.writer(file).writerow
        write([*heads, f"tilt_x{LINK}[rad]", f"tilt_y{LINK}[rad]"])
        for i in range(len(q)):
            point = [*xyz[i].tolist(), "", ""] if i < seen else ["", "", "", *tilt[i].tolist()]
            write([*q[i].tolist(), *point])
    return q, xyz, tilt


def robot_file(path, dh=DH, *, free=False):
    joints = "".join(
        f"[[joint]]\ntheta = {float(t)!r}\nd = {float(d)!r}\na = {float(a)!r}\nalpha = {float(al)!r}\n"
        for t, d, a, al in dh
    )
    tool = f"[tool]\nxyz = {TOOL.tolist()}\nfree = {str(free).lower()}\n[base]\nfree = {str(free).lower()}\n"
    path.write_text(f'name = "typed"\nconvention = "dh"\n{joints}{tool}')
    return path


@pytest.fixture
def mixed(tmp_path):
    """Ten points, 30 inclinometer readings, and the file of the nominal arm."""
    made = hidden(1e-3)
    q, xyz, tilt = write_rows(tmp_path / "mixed.csv", made, seen=10, tilted=30, seed=1)
    robot_file(tmp_path / "arm.toml")
    return q, xyz, tilt


def test_evaluate_reports_the_measured_positions_alone(mixed, run, tmp_path):
    q, xyz, tilt = mixed
    status, out, err = run("evaluate", "mixed.csv", "--robot", "arm.toml", "--json", "r.json")
    assert status == 0, err
    found = json.loads((tmp_path / "r.json").read_text())
    off = 1e3 * np.linalg.norm(points(DH, q) - xyz, axis=1)[:10]
    for name, value in (("mean", off.mean()), ("rms", np.sqrt((off**2).mean())), ("max", off.max())):
        assert found["errors"]["position_mm"][name] == pytest.approx(value, rel=1e-6)
        assert f"{value:.3f}" in out
    assert found["errors"]["orientation_deg"] is None  # the tool's; nobody measured it
    assert [row["position_mm"] is None for row in found["rows"]] == [False] * 10 + [True] * 30
    u = upwards(DH, q)
    seen = np.stack(
        [
            -np.sin(tilt[:, 1]),
            np.cos(tilt[:, 1]) * np.sin(tilt[:, 0]),
            np.cos(tilt[:, 1]) * np.cos(tilt[:, 0]),
        ],
        1,
    )
    angle = np.rad2deg(np.linalg.norm(np.cross(seen, u), axis=1))[10:]
    assert found["errors"]["tilt_deg"]["rms"] == pytest.approx(np.sqrt((angle**2).mean()), rel=1e-6)


def test_inclinometers_alone_give_no_position(run, tmp_path):
    write_rows(tmp_path / "tilts.csv", hidden(1e-3), seen=0, tilted=20, seed=1)
    robot_file(tmp_path / "arm.toml")
    status, out, err = run("evaluate", "tilts.csv", "--robot", "arm.toml", "--json", "r.json")
    assert status == 0, err
    found = json.loads((tmp_path / "r.json").read_text())["errors"]
    assert found["position_mm"] is None
    assert found["orientation_deg"] is None
    assert found["tilt_deg"]["mean"] > 0.01
    assert "0.000" not in out
    evaluation = wb.evaluate(
        wb.load_robot(tmp_path / "arm.toml"), wb.read_measurements(tmp_path / "tilts.csv")
    )
    assert len(evaluation.plot().axes) == 1


def test_verify_judges_the_measured_positions_alone(mixed, run, tmp_path):
    """All ten points within a limit: 0.05^(1/10) = 74.1 % of all poses, whatever 30 inclinometer rows say."""
    q, xyz, _ = mixed
    off = 1e3 * np.linalg.norm(points(DH, q) - xyz, axis=1)[:10]
    words = ("verify", "mixed.csv", "--robot", "arm.toml", "--json", "r.json")
    status, out, err = run(*words, "--wanted", f"{1.01 * off.max()}mm", "--report", "out")
    assert status == 0, err
    found = json.loads((tmp_path / "r.json").read_text())
    assert (found["rows"], found["poses"]) == (10, 10)
    assert found["share_within_at_least"] == pytest.approx(0.05**0.1, rel=1e-6)
    assert found["errors"]["position_mm"]["mean"] == pytest.approx(off.mean(), rel=1e-6)
    assert found["errors"]["orientation_deg"] is None
    assert found["intervals"]["orientation_deg"] is None
    low, high = found["intervals"]["position_mm"]["mean"]
    assert off.min() < low < off.mean() < high < off.max()
    assert any("10 of 40" in text for text in found["warnings"])
    assert "10 of 40" in out
    assert "10 measurements of 10" in (tmp_path / "out" / "certificate.html").read_text()
    status, _, _ = run(*words, "--wanted", f"{0.99 * off.max()}mm")
    assert status == 2
    assert json.loads((tmp_path / "r.json").read_text())["failed_rows"] == [int(off.argmax())]


def test_a_limit_on_orientations_is_not_kept_by_those_that_nobody_measured(mixed, tmp_path):
    """Neither the verdict nor the certificate may speak of an orientation."""
    arm, data = wb.load_robot(tmp_path / "arm.toml"), wb.read_measurements(tmp_path / "mixed.csv")
    found = wb.verify(arm, data, wanted=Wanted(position=1.0, rotation=1e-6))
    assert found.passed
    assert "°" not in found.verdict
    assert any("orientation" in text for text in found.warnings)


def test_orientations_in_some_rows_bound_the_share_by_those_rows(tmp_path):
    """Thirty points, five of them with an orientation: both limits were judged at five poses."""
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (30, 6))
    rotation = frames(DH, q)[-1][:, :3, :3].copy()
    rotation[5:] = np.nan
    data = wb.Dataset(q, points(DH, q), rotation)
    found = wb.verify(
        wb.load_robot(robot_file(tmp_path / "arm.toml")), data, wanted=Wanted(position=1e-4, rotation=1e-4)
    )
    assert found.passed
    assert found.least_share == pytest.approx(0.05**0.2, rel=1e-6)


def test_nothing_is_verified_where_no_fresh_row_has_a_position(mixed, tmp_path):
    data = wb.read_measurements(tmp_path / "mixed.csv")
    with pytest.raises(DataError):
        wb.verify(wb.load_robot(tmp_path / "arm.toml"), data.take(np.arange(12, 40)), wanted=1.0)


def test_the_certificate_of_a_mixed_table_counts_its_points(mixed, tmp_path):
    arm, data = wb.load_robot(tmp_path / "arm.toml"), wb.read_measurements(tmp_path / "mixed.csv")
    found = wb.verify(arm, data, wanted=1.0)
    assert len(found.data) == len(found.judged_positions) == 10
    assert np.isfinite(found.judged_positions).all()
    assert write_certificate(found, tmp_path / "c.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_fit_reports_the_held_out_points_alone(command, run, tmp_path):
    """Held out: 15 points and 15 inclinometer rows; the mean is recomputed from the saved file."""
    made = hidden(1e-3, seed=5)
    write_rows(tmp_path / "fit.csv", made, seen=60, tilted=20, seed=1, noise=1e-4)
    q, xyz, _ = write_rows(tmp_path / "held.csv", made, seen=15, tilted=15, seed=2, noise=2e-4)
    robot_file(tmp_path / "arm.toml")
    words = ("fit.csv", "--robot", "arm.toml", "--held-out", "held.csv", "--noise", "0.1mm,0.001deg")
    words += ("--algorithm", "ols") if command == "identify" else ()
    status, _, err = run(command, *words, "--save", "cal.toml", "--json", "r.json", "--report", "out")
    assert status == 0, err
    found = json.loads((tmp_path / "r.json").read_text())
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


def test_the_page_says_no_number_of_what_nobody_measured(tmp_path):
    """Inclinometers alone in the app: its sentence, its card and its recorded numbers."""
    write_rows(tmp_path / "tilts.csv", hidden(1e-3), seen=0, tilted=60, seed=1)
    first = start(wb.load_robot(robot_file(tmp_path / "arm.toml")), wb.load_plate("table2"))
    worker = Worker(first)
    try:
        for command in (LoadData("tilts.csv", (tmp_path / "tilts.csv").read_bytes()), Identify()):
            worker.submit(command)
            assert worker.wait(120.0)
        session = worker.session
        assert session.identification is not None, session.messages[-1].text
        shown = (
            session.messages[-1].text,
            guide(session).sentence,
            guide(session).figure,
            result_card(session),
        )
        assert not any("nan" in text or "0 mm" in text for text in shown), shown
        assert changed_numbers(session, None)
    finally:
        worker.close()

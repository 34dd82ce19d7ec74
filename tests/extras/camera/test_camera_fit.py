"""Cameras as the instrument: what they find, what they refuse, against virtual arms of another code."""

import json
import re
from dataclasses import replace

import camera_arms as virtual
import numpy as np
import pytest
from refusals import mentions
from slow import slow

import workbench as wb
from workbench.base.errors import WorkbenchError
from workbench.extras.camera.rig import rig_of
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.consider_covariance import Considered
from workbench.identification.noise import factor_at
from workbench.identification.problem import Noise, Problem


def filed(folder, name, shots, *, mounted="world", free="false", cameras=1, solids=1, k=virtual.K, target=""):
    """The arm of a session with a camera, whose files are written."""
    other = {"world": "tool", "tool": "world"}[mounted]
    files = {
        "pixels.csv": shots.table(),
        "joints.csv": shots.joints(),
        "camera.toml": virtual.camera_toml(cameras, mounted=mounted, free=free, k=k),
        "target.toml": target or virtual.target_toml(other, solids),
        "robot.toml": virtual.robot_toml(name),
    }
    for file, text in files.items():
        (folder / file).write_text(text)
    return wb.load_robot(str(folder / "robot.toml"))


def written(folder, name, shots, **options):
    """The arm, and the data that the files hold."""
    return filed(folder, name, shots, **options), read(folder)


def read(folder, pixels="pixels.csv", **options):
    rig = wb.read_rig(folder / "camera.toml", folder / "target.toml")
    return wb.read_pixels(folder / pixels, rig, joints=folder / "joints.csv", **options)


def identified(run, folder, *options):
    """Exit status of the command on the files of a folder."""
    files = ("camera.toml", "target.toml", "joints.csv", "robot.toml")
    given = [w for f in files for w in (f"--{f.split('.')[0]}", str(folder / f))]
    return run("identify", str(folder / "pixels.csv"), *given, "--algorithm", "opt2", *options)[0]


def true_errors(arm, robots, seed=5):
    """Errors [mm] at other poses, the best frames before and after the arm granted."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-2.0, 2.0, (200, len(arm.dh)))
    direction = np.sign(rng.normal(size=q.shape))
    return [1e3 * virtual.rigid_error(wb.tool_poses(r, q), arm.poses(q, direction)) for r in robots]


def check_zeros(fit, arm):
    """Zeros of joints 2 to 5 are found within four standard errors; returns these [rad]."""
    place = [fit.problem.names.index(f"joint{k}.theta") for k in (2, 3, 4, 5)]
    off, std = fit.x[place] - fit.problem.start[place], fit.std[place]
    assert (np.abs(off - arm.zeros[1:5]) < 4.0 * std).all()
    return std


def check_found(fit, shots, widest, more=0.0):
    """Camera and target are found within four standard errors and some more [m], which are not too wide."""
    for owner, pose in (("camera[c0]", shots.camera[0]), ("target", shots.target)):
        at = [fit.problem.names.index(f"{owner}.{axis}") for axis in "xyz"]
        assert (np.abs(fit.x[at] - pose[:3, 3]) < 4.0 * fit.std[at] + more).all()
        assert fit.std[at].max() < widest


def test_zeros_and_hand_eye_lie_in_their_intervals(tmp_path):
    rng, arm = virtual.made(3, "hobby", zeros=virtual.MIDDLE)
    shots = virtual.scene(rng, arm, 25)
    robot, data = written(tmp_path, "hobby", shots)
    run = wb.identify(robot, data, algorithms=("opt2",))
    fit = run.best.fit
    assert len(run.held_out_data)
    assert not run.suspects
    assert run.identifiability.title == "joint zeros"
    assert run.best.file_errors["TOML"].expected.rotation >= run.robot.calibration.observed.tool.rotation
    assert [n for n in fit.problem.names if n.endswith("theta")] == [f"joint{k}.theta" for k in (2, 3, 4, 5)]
    assert np.rad2deg(check_zeros(fit, arm).max()) < 0.02
    check_found(fit, shots, 2e-3)
    before, after = true_errors(arm, (robot, run.robot))
    assert before > 0.5
    assert after < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("on_tool", [False, True])
def test_boards_that_stand_anywhere_to_one_another(tmp_path, on_tool):
    """Each has its own pose with its own interval; one that is seen once is left out, in a sentence."""
    rng, arm = virtual.made(11, "hobby", zeros=virtual.MIDDLE)
    shots = virtual.scene(rng, arm, 16, on_tool=on_tool, solids=2)
    robot, data = written(tmp_path, "hobby", shots, mounted="tool" if on_tool else "world", solids=2)
    run = wb.identify(robot, data, algorithms=("opt2",))
    fit = run.best.fit
    check_zeros(fit, arm)
    stated = run.identifiability.json(run.best.fit)["camera"]["poses"]
    for owner, pose in zip(("target[A]", "target[B]"), shots.targets, strict=True):
        at = stated[owner]
        spread = 1e-3 * np.array(at["xyz_std_mm"])
        assert (np.abs(at["xyz"] - pose[:3, 3]) < 4.0 * spread).all()
        assert spread.max() < 3e-3
    assert sum("target[B] on the" in text for text in run.identifiability.found(run.best.fit)) == 1
    first = min(image for image, _, k, _, _, _ in shots.rows if k >= virtual.SOLID)
    rows = [r for r in shots.rows if r[2] < virtual.SOLID or r[0] == first]
    (tmp_path / "once.csv").write_text(replace(shots, rows=rows).table())
    alone = read(tmp_path, "once.csv")
    assert not alone.readings.seen[..., rig_of(alone).parts[1][1]].any()
    assert any("target[B] is in 1 picture" in note for note in alone.notes)


@pytest.mark.slow
def test_the_shifted_joint_is_named(tmp_path, run):
    rng, arm = virtual.made(2, "industrial", angle=1.2e-4, length=0.8e-4, zeros=1.5e-4)
    arm.zeros[2] += np.deg2rad(0.7)
    shots = virtual.scene(rng, arm, 60)
    robot, _ = written(tmp_path, "industrial", shots)
    found = tmp_path / "found.json"
    saved = tmp_path / "calibrated.toml"
    assert not identified(run, tmp_path, "--json", str(found), "--save", str(saved))
    stated = json.loads(found.read_text())
    zeros = {p["name"]: p for p in stated["algorithms"]["opt2"]["parameters"] if ".theta" in p["name"]}
    moved = {name: p["value"] - p["nominal"] for name, p in zeros.items()}
    assert max(moved, key=lambda name: abs(moved[name])) == "joint3.theta"
    assert abs(moved["joint3.theta"] - arm.zeros[2]) < 4.0 * zeros["joint3.theta"]["std"]
    assert stated["algorithms"]["opt2"]["held_out"]["pixel_px"]["rms"] < 0.5
    assert stated["camera"]["poses"]["camera[c0]"]["mounted"] == "world"
    before, after = true_errors(arm, (robot, wb.load_robot(str(saved))))
    assert before > 2.0
    assert after < 0.25


def test_what_does_not_carry_is_refused_and_said(tmp_path, run):
    """Ten pictures of an arm that is right: nothing is identified, and nothing is saved."""
    rng, arm = virtual.made(6, "ur5", compliance=np.full(6, 1e-5), backlash=np.full(6, 1e-4))
    shots = virtual.scene(rng, arm, 12)
    robot, data = written(tmp_path, "ur5", shots)
    result = wb.identify(robot, data, algorithms=("opt2",))
    assert result.robot.values(robot.default_free) == pytest.approx(robot.values(robot.default_free), abs=0.0)
    assert "take more" in result.identifiability.refused
    assert any("nothing of the arm was identified" in text for text in result.warnings)
    saved = tmp_path / "calibrated.toml"
    assert identified(run, tmp_path, "--save", str(saved)) == 2
    assert not saved.exists()
    held = wb.evaluate(robot, data).errors
    assert 0.01 < held.position_mm.rms < 2.0
    assert 0.2 < held.spreads["pixel_px"].rms < 2.0
    for call, text in (
        (lambda: wb.read_measurements(tmp_path / "pixels.csv"), "--camera and --target"),
        (lambda: wb.read_pixels(tmp_path / "pixels.csv", rig_of(data)), "has no joints"),
        (lambda: wb.diagnose(robot, data), "can't be diagnosed"),
    ):
        with pytest.raises(WorkbenchError, match=text):
            call()


def test_wrong_corners_are_set_apart_by_name_and_pictures_of_other_joints_too(tmp_path):
    rng, arm = virtual.made(7, "ur5", zeros=1e-3)
    shots = virtual.scene(rng, arm, 20)
    image, camera, tag, corner, u, v = shots.rows[40]
    shots.rows[40] = (image, camera, tag, corner, u + 25.0, v - 10.0)
    shots.q[9] += 0.1
    robot, data = written(tmp_path, "ur5", shots)
    assert [(a.image, a.id, a.corner) for a in rig_of(data).rejected] == [(str(image), tag, corner)]
    assert rig_of(data).rejected[0].off == pytest.approx(27.0, abs=2.0)
    run = wb.identify(robot, data, algorithms=("opt2",), held_out=0.0)
    assert [row for row, _ in run.excluded] == [9]
    assert mentions(run.excluded[0][1], "image 9")
    assert true_errors(arm, (run.robot,))[0] < 0.15


@pytest.mark.parametrize(
    ("count", "free", "scale", "focal", "message"),
    [
        slow(25, '"auto"', 0.75, 1.0, r"^the target is 25\.0\d % smaller than stated"),
        slow(25, "false", 1.0, 1.07, r"^the given intrinsics do not fit .*\(camera c0: fx 135\d"),
        (8, "false", 1.005, 1.0, r"^the target is 0\.[456]\d % larger than stated"),
    ],
)
def test_what_was_given_wrong_is_blamed_alone(tmp_path, count, free, scale, focal, message):
    """A square of 30 mm given as 40 mm, a focal length 7 % too long, and few pictures."""
    rng, arm = virtual.made(0, "ur5", zeros=np.deg2rad(0.3))
    shots = virtual.scene(rng, arm, count, scale=scale)
    wrong = virtual.K * [focal, focal, 1.0, 1.0]
    robot, data = written(tmp_path, "ur5", shots, free=free, k=wrong)
    identifiability = wb.identify(robot, data, algorithms=("opt2",)).identifiability
    assert re.search(message, *identifiability.doubts)
    assert identifiability.refused in ("", *identifiability.doubts)


def test_what_the_nominal_geometry_is_off_bends_zeros_as_considered(tmp_path):
    """Without noise, zeros err by what the covariance of a known geometry error says, sign aside."""
    rng, arm = virtual.made(10, "ur5")
    arm.dh[1, 2] += 1e-4
    robot, data = written(tmp_path, "ur5", virtual.scene(rng, arm, 20, noise=0.0))
    names = tuple(n for n in robot.joint_offsets if n not in ("joint1.theta", "joint6.theta"))
    problem = Problem.build(robot, data, free=names, noise=Noise(0.0, 0.0, (), 0.3))
    everything = Problem.build(robot, data, free=(*names, "joint2.a"), noise=problem.noise)
    off = np.array([1e-4 if n == "joint2.a" else 0.0 for n in everything.names])
    x = Opt2(limit=60).search(problem).x
    spread = Considered(everything, off).covariance(problem.names, x, factor_at(problem, x).root)
    moved = [problem.names.index(n) for n in names]
    found = np.abs(x - problem.start)[moved]
    assert np.sqrt(np.diag(spread)[moved]) == pytest.approx(found, rel=0.05, abs=1e-7)
    assert found.max() > 2e-5

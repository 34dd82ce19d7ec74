"""Every form for every built-in arm: written, and read by somebody else."""

import numpy as np
import pytest
from checks import any_joints
from refusals import refuses

from tests.exports import readers
from tests.exports.test_exports import EXACT, calibrated, flanges
from workbench import Frame, Motion, Robot, load_robot, tool_poses
from workbench.arm.joint_frames import Z, joint_frames
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.errors import FileError, OptionError, RobotError
from workbench.exports import FORMS, Job, export_robot


def refusing(nominal: Robot) -> set[str]:
    """Forms that have no place for such an arm."""
    out = {"urdf"}  # which brings a file up to date, and writes no new one
    turning = all(joint.kind == "revolute" for joint in nominal.moving)
    for name, dofs in (("ur", (6,)), ("xarm", (5, 6, 7)), ("franka", (7,))):
        is_ur = nominal.name.startswith("UR")
        if nominal.dof not in dofs or not turning or (nominal.dof == 6 and is_ur is not (name == "ur")):
            out.add(f"{name}-kinematics")
    standard = nominal.convention in ("dh", "hayati") and {j.kind for j in nominal.joints} == {"revolute"}
    if not standard or any(row.get("beta") for row in _rows(nominal)):
        out.add("ur-calibration")
    return out


@pytest.mark.parametrize("name", built_in_robots())
def test_every_form_of_every_built_in_arm_round_trips_or_says_what_is_lost(name, tmp_path):
    nominal, arm = calibrated(name)
    refused = refusing(nominal)
    for form in FORMS.values():
        job = Job(robot=arm, nominal=nominal)
        path = tmp_path / f"{form.name}{form.ending}"
        if form.name in refused:
            with pytest.raises((OptionError, RobotError), match=form.name):
                export_robot(form, path, job)
            assert not path.exists()
            continue
        done = export_robot(form, path, job, rows=40)
        assert done.path.read_text()
        assert max(done.position, done.rotation) < EXACT, form.name
        assert "agrees" in done.verdict, form.name


@pytest.mark.parametrize(("form", "name"), [
    ("ur-kinematics", "ur10"), ("xarm-kinematics", "xarm6"), ("franka-kinematics", "panda"),
])  # fmt: skip
def test_kinematics_files_mean_the_arm_to_an_independent_reader(form, name, tmp_path):
    _, arm = calibrated(name)
    arm = arm.with_frames(tool=Frame())
    text = export_robot(FORMS[form], tmp_path / "k.yaml", Job(robot=arm), rows=5).path.read_text()
    if form[0] == "f":  # link 7 is at the foot of its joint's axis, as in the maker's file
        place = [float(v) for v in text.partition("joint7:")[2].split()[2:7:2]]
        np.testing.assert_allclose(place, [0.088, 0.0, 0.0], atol=5e-3)
    head, inner = ("kinematics", "") if form[0] in "ux" else ("", "kinematic")
    pose = readers.kinematics_file(text, head, inner)
    q = any_joints(arm, 20, seed=1)
    left = np.eye(4) if inner else se3.inverse(pose(np.zeros(arm.dof))) @ joint_frames(arm).at_zero[-1]
    for row, wanted in zip(q, flanges(arm, q), strict=True):
        np.testing.assert_allclose(pose(row) @ left, wanted, atol=EXACT)


def test_ur_files_have_the_vendors_frames_and_a_hash_of_their_own(tmp_path):
    """Of a nominal arm they are the numbers of ur_description itself, which meshes hang on."""
    import yaml

    text = export_robot(FORMS["ur-kinematics"], tmp_path / "k.yaml", Job(robot=load_robot("ur5")), rows=5)
    table = yaml.safe_load(text.path.read_text())["kinematics"]
    assert table["shoulder"]["z"] == pytest.approx(0.089159)
    assert table["upper_arm"]["roll"] == pytest.approx(np.pi / 2)
    wrist = {"x": -0.39225, "y": 0, "z": 0.10915, "roll": 0, "pitch": 0, "yaw": 0}
    assert table["wrist_1"] == pytest.approx(wrist)
    assert table["wrist_2"]["y"] == pytest.approx(-0.09465)
    assert table["hash"].startswith("calib_")
    other = export_robot(FORMS["ur-kinematics"], tmp_path / "o.yaml", Job(robot=calibrated("ur5")[1]), rows=5)
    assert table["hash"] not in other.path.read_text()
    assert any("TCP" in note for note in other.notes)
    assert not any("TCP" in note for note in text.notes)


def test_frames_follow_those_of_a_file_that_is_brought_up_to_date(tmp_path):
    """xArm's links are turned against the table's, and its meshes with them."""
    _, arm = calibrated("xarm6")
    own = joint_frames(arm)
    turn = [se3.pose(se3.rotvec_to_matrix(a * Z), a / 9 * Z) for a in (1, -1, 2, 3, 0, -2)]
    moved = zip([np.eye(4), *turn], own.joints, turn, strict=False)
    origins = [se3.inverse(before) @ joint.origin @ after for before, joint, after in moved]
    other = own.with_origins(origins, se3.inverse(turn[-1]) @ own.flange)
    form = FORMS["xarm-kinematics"]
    job = Job(robot=other.robot(arm))
    source = form.write(job)
    done = export_robot(form, tmp_path / "k.yaml", Job(robot=arm, source=source), rows=20)
    assert max(done.position, done.rotation) < EXACT
    numbers = [
        [float(line.split(": ")[1]) for line in text.splitlines() if ": " in line and "#" not in line]
        for text in (done.path.read_text(), source)
    ]
    np.testing.assert_allclose(numbers[0][:30], numbers[1][:30], atol=1e-9)
    with pytest.raises(FileError):
        export_robot(form, tmp_path / "k.yaml", Job(robot=arm, source="kinematics:\n  joint1:\n    x: 0\n"))


@pytest.mark.parametrize("seed", [0, 1])
def test_a_ur_controller_computes_the_calibrated_arm_and_keeps_its_other_lines(seed, tmp_path):
    nominal, arm = calibrated("ur10", seed)
    source = (
        "[mounting]\ndelta_theta = [ 0, 0, 0, 0, 0, 0]\ndelta_a = [ 0, 0, 0, 0, 0, 0]\n"
        "delta_d = [ 0, 0, 0, 0, 0, 0]\ndelta_alpha = [ 0, 0, 0, 0, 0, 0]\njoint_checksum = [ 0x6e0f7bf]\n"
    )
    arm = arm.with_frames(tool=Frame())
    form = FORMS["ur-calibration"]
    job = Job(robot=arm, nominal=nominal, source=source)
    text = export_robot(form, tmp_path / "calibration.conf", job, rows=20).path.read_text()
    assert "joint_checksum = [ 0x6e0f7bf]" in text
    assert len(text.splitlines()) == len(source.splitlines())
    alpha = next(line for line in text.splitlines() if line.startswith("delta_alpha"))
    assert max(abs(float(v)) for v in alpha.split("[")[1].strip(" ]").split(",")) < 0.05  # no axis reversed
    rows = np.array([[t[c] for c in ("theta", "d", "a", "alpha")] for t in _rows(nominal)])
    pose = readers.ur_controller(text, rows)
    q = any_joints(arm, 20, seed=1)
    left = se3.inverse(pose(np.zeros(6))) @ flanges(arm, np.zeros((1, 6)))[0]
    for row, wanted in zip(q, flanges(arm, q), strict=True):
        np.testing.assert_allclose(pose(row) @ left, wanted, atol=EXACT)
    assert form.read(text, job).convention == "dh"
    for wrong in ("panda", "ur5"):
        other = Job(robot=arm, nominal=load_robot(wrong), source=source if wrong == "panda" else "x = 1")
        with pytest.raises((OptionError, FileError)):
            form.write(other)


def _rows(robot: Robot) -> list[dict]:
    from workbench.arm.robot_toml import robot_to_table

    return robot_to_table(robot)["joint"]


@pytest.mark.parametrize("name", ["aria", "ur10", "panda"])
def test_mujoco_models_are_read_by_pinocchio(name, tmp_path):
    _, arm = calibrated(name)
    arm = arm.with_frames(base=Frame(np.array([0.3, 0.1, 0.5]), se3.rpy_to_matrix(np.array([0.2, 0.1, 1.0]))))
    path = export_robot(FORMS["mjcf"], tmp_path / "arm.xml", Job(robot=arm), rows=5).path
    pose, q = readers.mjcf(str(path)), any_joints(arm, 20, seed=1)
    for row, wanted in zip(q, tool_poses(arm, Motion(q)), strict=True):
        np.testing.assert_allclose(pose(row), wanted, atol=EXACT)


def test_mujoco_bodies_weigh_where_the_links_do(tmp_path):
    """Moments that hold the arm, by pinocchio from the model, are those that the package computes."""
    import pinocchio as pin

    from workbench.arm.statics.moments import joint_moments

    _, arm = calibrated("ur10")
    path = export_robot(FORMS["mjcf"], tmp_path / "arm.xml", Job(robot=arm), rows=5).path
    model = pin.buildModelFromMJCF(str(path))
    data, q = model.createData(), any_joints(arm, 3, seed=1)
    for row, wanted in zip(q, joint_moments(arm, Motion(q)).about, strict=True):
        np.testing.assert_allclose(pin.computeGeneralizedGravity(model, data, row), wanted, atol=1e-3)


def test_a_drivers_file_of_another_arm_is_not_brought_up_to_date(tmp_path):
    form = FORMS["ur-kinematics"]
    source = form.write(Job(robot=load_robot("ur10")))
    with refuses(RobotError, "arm of the source"):
        export_robot(form, tmp_path / "k.yaml", Job(robot=calibrated("ur5")[1], source=source))


def test_a_file_for_another_makers_arm_is_refused_or_said(tmp_path):
    with refuses(OptionError, "joint axes"):
        export_robot(FORMS["xarm-kinematics"], tmp_path / "k.yaml", Job(robot=load_robot("ur10")))
    job = Job(robot=load_robot("iiwa14"))
    notes = export_robot(FORMS["franka-kinematics"], tmp_path / "k.yaml", job, rows=5).notes
    assert any("Panda" in note and "maker" in note for note in notes)


def test_a_controllers_own_file_is_read_in(run, tmp_path):
    """The factory's calibration of a UR, with d of a kilometre and back, becomes the next nominal arm."""
    conf = tmp_path / "calibration.conf"
    conf.write_text(
        "delta_theta = [ 1e-3, 0, 0, 0, 0, 0]\ndelta_a = [ 0, 1e-3, 0, 0, 0, 0]\n"
        "delta_d = [ 0, 1e3, -1e3, 0, 0, 0]\ndelta_alpha = [ 0, 0, 0, 0, 0, 0]\n"
    )
    out = tmp_path / "mine.toml"
    assert run("new", "ur10", "--apply", conf, "--for", "ur-calibration", "--out", out)[0] == 0
    mine, ur10 = load_robot(out), load_robot("ur10")
    assert mine.values(("joint1.theta", "joint2.a")) == pytest.approx([1e-3, -0.611])
    assert [mine.reach, *mine.values(("joint2.d",))] == pytest.approx([ur10.reach, 0.0], abs=2e-3)
    assert [joint.mass for joint in mine.joints] == [joint.mass for joint in ur10.joints]
    conf.write_text(conf.read_text().replace("delta_a = [ 0, 1e-3", "delta_a = [ 0.3, 0.2"))
    code, _, error = run(
        "new", "ur10", "--apply", conf, "--for", "ur-calibration", "--out", tmp_path / "no.toml"
    )
    assert code == 1  # no UR10 is made like that
    assert "UR10" in error
    assert not (tmp_path / "no.toml").exists()

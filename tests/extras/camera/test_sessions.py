"""Boards and cameras elsewhere in every session; the error expected at other poses; arms of another code."""

import camera_arms as virtual
import numpy as np
import pytest
from slow import slow
from test_camera_fit import check_zeros, read, true_errors, written

import workbench as wb

DAYS = ("mon", "tue", "wed")
OWN = "per_session = true\n"


def days(rng, arm, counts, *, moved):
    """Scenes between which the camera, or the target, was put elsewhere."""
    first = virtual.scene(rng, arm, counts[0])
    kept = {"targets": first.targets} if moved == "camera" else {"cameras": first.camera}
    return [first, *(virtual.scene(rng, arm, count, **kept) for count in counts[1:])]


def filed(folder, shots, *, moved):
    """The files of a joined scene whose camera, or target, has a pose of its own each day."""
    target = (OWN if moved == "target" else "") + virtual.target_toml()
    robot, _ = written(folder, "hobby", shots, target=target)
    (folder / "camera.toml").write_text(virtual.camera_toml() + (OWN if moved == "camera" else ""))
    return robot, read(folder)


@pytest.mark.parametrize("moved", ["camera", slow("target")])
def test_every_session_has_its_own_pose_with_its_interval(tmp_path, moved):
    rng = np.random.default_rng(3)
    arm = virtual.made(rng, "hobby", zeros=np.deg2rad(0.3))
    arm.zeros[[0, -1]] = 0.0
    shots = days(rng, arm, (9, 9, 9), moved=moved)
    robot, data = filed(tmp_path, virtual.joined(**dict(zip(DAYS, shots, strict=True))), moved=moved)
    run = wb.identify(robot, data, algorithms=("opt2",))
    check_zeros(run.best.fit, arm)
    found = run.identifiability.json(run.best.fit)["camera"]["poses"]
    owner, other = ("camera[c0]", "target") if moved == "camera" else ("target", "camera[c0]")
    assert set(found) == {other, *(f"{owner}[{day}]" for day in DAYS)}
    for day, shot in zip(DAYS, shots, strict=True):
        at, truth = found[f"{owner}[{day}]"], shot.camera[0] if moved == "camera" else shot.target
        spread = 1e-3 * np.array(at["xyz_std_mm"])
        assert (np.abs(at["xyz"] - truth[:3, 3]) < 4.0 * spread).all()
        assert spread.max() < 3e-3
        assert at["session"] == day
    before, after = true_errors(arm, (robot, run.robot))
    assert after < 0.2 * before


NEAR = 0.15


def near_error(arm, shots, robot, rng):
    """Error [mm] at poses near the measured places, in any orientation, the best frames granted."""
    q = rng.uniform(-virtual.LIMIT, virtual.LIMIT, (3000, len(arm.dh)))
    tools = arm.poses(q, np.sign(rng.normal(size=q.shape)))
    kept = np.linalg.norm(tools[:, None, :3, 3] - shots.truth[:, :3, 3], axis=2).min(1) < NEAR
    return 1e3 * virtual.rigid_error(wb.tool_poses(robot, q[kept]), tools[kept])


@pytest.mark.parametrize("seeds", [(0,), slow(range(4))])
@pytest.mark.parametrize(("name", "turned"), [slow("ur5", 0.1), slow("industrial", np.inf), ("7R", 0.1)])
def test_errors_at_other_poses_are_as_large_as_expected(tmp_path, name, turned, seeds):
    """Zeros alone or nothing is taken of arms whose geometry is off; small turns leave other ways open."""
    ratios = []
    for seed in seeds:
        rng = np.random.default_rng([seed, 36])
        sag = rng.uniform(0.3, 1.5, len(virtual.ARMS[name])) * 1e-5
        off = {"zeros": np.deg2rad(0.1), "angle": 1e-4, "length": 1e-4}
        arm = virtual.made(rng, name, compliance=sag, **off)
        shots = virtual.scene(rng, arm, 20, turned=turned)
        robot, data = written(tmp_path, name, shots, free='"auto"')
        run = wb.identify(robot, data, algorithms=("opt2",), held_out=0.0)
        error = near_error(arm, shots, run.robot, np.random.default_rng([seed, 37]))
        ratios.append(error / (1e3 * run.identifiability.step.expected))
    assert max(ratios) < 2.0
    assert 0.25 < np.sqrt(np.mean(np.square(ratios))) < 1.4

"""Boards and cameras elsewhere in every session; arms of another code."""

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
    rng, arm = virtual.made(3, "hobby", zeros=virtual.MIDDLE)
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

"""The generated program against the package: poses with every effect, corrections pose by pose."""

import runpy
from types import SimpleNamespace

import numpy as np
import pytest
from gear_sag import GearSag
from refusals import refuses

from tests.exports import test_exports
from workbench.arm.effects import EFFECTS, AbstractEffect
from workbench.arm.frame import Frame
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.inverse.solutions import task_jacobian
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.exports import FORMS, Job, export_robot
from workbench.extras.trajectories.correction import correct
from workbench.extras.trajectories.path import command_joints

STATE = {"payload": 1.5, "temperature": 31.0}


def in_python(robot: Robot, nominal: Robot, folder):
    path = export_robot(FORMS["python-module"], folder / "arm.py", Job(robot=robot, nominal=nominal)).path
    assert "workbench" not in path.read_text().split('"""', 2)[2]
    return SimpleNamespace(**runpy.run_path(str(path)))


def calibrated(name: str, *effects: AbstractEffect) -> tuple[Robot, Robot]:
    nominal, arm = test_exports.calibrated(name)
    return nominal, arm.with_frames(base=nominal.base).with_effects(*effects)


def poses(robot: Robot, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Joints away from limits and singularities, and directions of their last motion."""
    low, high = robot.search_limits.T
    rng = np.random.default_rng(1)
    kept: list[np.ndarray] = []
    while sum(map(len, kept)) < rows:  # a small arm has few that are far enough from singular
        q = rng.uniform(0.9 * low + 0.1 * high, 0.9 * high + 0.1 * low, (3 * rows, robot.dof))
        jacobians = task_jacobian(compile_arm(robot), q, Task.default(robot.dof))
        kept.append(q[np.linalg.svd(jacobians, compute_uv=False)[:, -1] > min(0.05, 0.05 * robot.reach)])
    q = np.concatenate(kept)[:rows]
    return np.ascontiguousarray(q), np.sign(rng.normal(size=q.shape))


def every_kind(dof: int) -> tuple[AbstractEffect, ...]:
    """Effects that lower to every kind of term."""
    make = EFFECTS
    knots = (-1.5, -0.5, 0.5, 1.5)
    return (
        make["joint-compliance"](tuple(range(dof)), (2e-5,) * dof),
        make["backlash"]((0,), (2e-4,), by="motion"),
        make["backlash"]((2,), (1e-4,), width=3.0),
        make["clearance-tilt"]((1,), (1e-4,)),
        make["link-flexure"]((1,), (1e-5, 3e-5)),
        make["joint-harmonic"]((0,), (1e-3, 2e-3)),
        make["encoder-scale"]((1,), (1e-3,)),
        make["thermal-growth"]((), (2e-5,)),
        make["local-joint-error"]((3,), (1e-3, -1e-3, 5e-4, 2e-4), knots=knots),
    )


VARIANTS = {
    "backlash": [{"by": "motion"}, {"width": 2.0}],
    "joint-harmonic": [{"order": (1, 2, 5), "range": (-0.8, 0.9)}],
    "local-joint-error": [{"periodic": True, "knots": (-2.0, -1.0, 0.5, 2.0, 3.0)}],
}


def examples(name: str, robot: Robot) -> list[AbstractEffect]:
    """An effect of the catalogue as its example has it, and with its other settings."""
    rng = np.random.default_rng(2)
    kind = EFFECTS[name]
    out = [kind.example(robot, min(kind.usual_joint, robot.dof - 1) % robot.dof, rng)]
    for settings in VARIANTS.get(name, []):
        one = kind((0,) if name == "local-joint-error" else (2,), **settings)
        out.append(kind(one.joints, tuple(rng.normal(size=len(one.names))), **settings))
    if name == "gravity-sag":
        out.append(kind((1,), (1.0, -0.5, 0.3), terms="2x 3y payload", gravity=(0.1, 0.2, -1.0)))
    return [kind(e.joints, tuple(1e-3 * c for c in e.coefficients), **_settings(e)) for e in out]


def _settings(effect: AbstractEffect) -> dict:
    return {key: getattr(effect, key) for key in effect.settings()}


@pytest.mark.parametrize(
    "name", [n for n, e in EFFECTS.items() if e.moves_arm and not n.startswith(("extension-", "uneven-"))]
)
def test_the_program_bends_as_the_law_of_every_effect_does(name, tmp_path):
    nominal, plain = calibrated("ur10")
    effects = examples(name, plain)
    q, direction = poses(plain, 40)
    q[0, 2] = 2.95  # beyond what a map was learned on
    for number, effect in enumerate(effects):
        robot = plain.with_effects(effect).with_frames(base=Frame())
        folder = tmp_path / str(number)
        folder.mkdir()
        state = {key: np.full(len(q), value) for key, value in STATE.items()}
        wanted = tool_poses(robot, Motion(q, direction=direction, **state))
        assert np.abs(wanted - tool_poses(robot.with_effects(), Motion(q))).max() > 1e-5
        found = in_python(robot, nominal, folder).forward(q, direction=direction, **STATE)
        np.testing.assert_allclose(found, wanted, atol=1e-12)


def check(name: str, rows: int, folder, effects) -> None:
    """The program against `compensate`; a joint too many leaves a choice, which need not be the same."""
    nominal, robot = calibrated(name, *effects)
    q, direction = poses(robot, rows)
    state = {key: np.full(rows, value) for key, value in STATE.items()}
    wanted = correct(command_joints(robot, nominal, q), motion=Motion(q, direction=direction, **state))
    assert np.abs(wanted.q - q).max() > 1e-3
    found, left = in_python(robot, nominal, folder).correct(q, direction=direction, **STATE)
    np.testing.assert_allclose(found, wanted.q, atol=1e-9 if robot.dof < 7 else 1e-4, rtol=0.0)
    np.testing.assert_allclose(left[:, 0], wanted.after.position, atol=1e-11)


def test_programs_correct_as_compensate_does(tmp_path):
    check("ur10", 300, tmp_path, every_kind(6))


@pytest.mark.parametrize("name", ["panda", "katana450"])
def test_programs_of_arms_with_more_or_fewer_joints(name, tmp_path):
    """A seventh joint leaves a self-motion, on which the damping holds all solvers at the same place."""
    effects = () if name == "katana450" else (EFFECTS["joint-compliance"]((1, 3), (2e-5, 3e-5)),)
    check(name, 50, tmp_path, effects)


def test_poses_near_given_joints(tmp_path):
    nominal, robot = calibrated("ur10", EFFECTS["joint-compliance"]((1, 2), (2e-5, 3e-5)))
    q, _ = poses(robot, 30)
    wanted = tool_poses(robot.with_frames(base=Frame()), Motion(q))
    module = in_python(robot, nominal, tmp_path)
    found, left = module.correct_poses(wanted, q + 0.05)
    np.testing.assert_allclose(found, q, atol=1e-9)
    assert left.max() < 1e-9
    one, _ = module.correct(q[0])
    assert one.shape == (1, 6)


def test_what_drives_an_arm_must_be_given(tmp_path):
    nominal, robot = calibrated("ur10", *every_kind(6))
    module = in_python(robot, nominal, tmp_path)
    with pytest.raises(ValueError, match="temperature"):
        module.forward(np.zeros(6))
    with pytest.raises(ValueError, match="direction"):
        module.forward(np.zeros(6), temperature=20.0)


def test_what_a_program_can_not_hold_is_refused(tmp_path):
    nominal, robot = calibrated("iiwa14", EFFECTS["joint-compliance"]((1,), (2e-5,)))
    form = FORMS["python-module"]
    with refuses(OptionError, "mass", option="--for", found=form.name):
        export_robot(form, tmp_path / "x", Job(robot=robot, nominal=nominal))
    with refuses(OptionError, form.name, option="--nominal"):
        export_robot(form, tmp_path / "x", Job(robot=robot))
    strange = robot.with_effects(GearSag((0,), (1.0,)))
    with refuses(OptionError, option="--for", found="gear-sag"):
        export_robot(form, tmp_path / "x", Job(robot=strange, nominal=nominal))
    drifting = robot.with_effects(EFFECTS["base-drift"]((), (1e-6,) * 6))
    done = export_robot(form, tmp_path / "x.py", Job(robot=drifting, nominal=nominal))
    assert any("base-drift" in note for note in done.notes)

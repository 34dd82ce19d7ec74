"""The problem: its Jacobian for every observation, frames per session, priors, noise."""

from dataclasses import replace

import numpy as np
import pytest
from checks import check_problem
from refusals import refuses

from workbench import Dataset, Motion, Noise, link_frames, tool_poses
from workbench.arm.frame import FRAME_PARTS
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.data.observation import AbstractObservation, Channel, Linearised
from workbench.data.observations import OBSERVATIONS
from workbench.data.observations.tilt import reading
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import FrameFreedom, Problem

ROWS = 12
OURS = [kind for kind in OBSERVATIONS.values() if kind.__module__.startswith("workbench.data.")]
"""Those of extras and other packages have tests of their own."""


def measured(robot, rng, kind, sessions=None):
    """Rows of every kind of observation, away from the model so that no residual is zero."""
    q = rng.uniform(-1.0, 1.0, (ROWS, robot.dof))
    poses = tool_poses(robot, Motion(q))
    off = rng.normal(0.0, 0.02, (ROWS, 3))
    common = {"q": q, "row": np.arange(ROWS), "session": sessions}
    position = poses[:, :3, 3] + off
    match kind:
        case "PoseObservation":
            turn = se3.rotvec_to_matrix(rng.normal(0.0, 0.3, (ROWS, 3)))
            return Dataset(position=position, rotation=turn @ poses[:, :3, :3], **common)
        case "PointObservation":
            return Dataset(position=position, **common)
        case "MarkerObservation":
            layout = rng.normal(0.0, 0.05, (4, 3))
            markers = se3.apply(poses[:, None], layout[None]) + off[:, None]
            markers[3, 1] = np.nan
            return Dataset(markers=markers, **common)
        case "DistanceObservation":
            anchors = {"A": np.array([0.5, 0.1, 0.2]), "B": np.array([-0.3, 0.8, 0.1])}
            names = np.array(["A", "B"])[np.arange(ROWS) % 2]
            length = np.array([np.linalg.norm(p - anchors[n]) for p, n in zip(position, names, strict=True)])
            wire = {"draw_wire": np.where(names == "A", "W", "")}
            return Dataset(distance=length, anchor=names, more=wire, **common)
        case "PlaneObservation":
            return Dataset(contact=np.array(["plane a", "plane b"])[np.arange(ROWS) % 2], **common)
        case "ContactObservation":
            return Dataset(contact=np.array(["a", "b", "c"])[np.arange(ROWS) % 3], **common)
        case "TiltObservation":
            frames = link_frames(robot, Motion(q))
            turn = se3.rotvec_to_matrix(rng.normal(0.0, 0.02, (ROWS, 3)))
            tilt = {link: reading((turn @ frames[:, link, :3, :3])[:, 2]) for link in (2, 3, 6)}
            tilt[3][4] = np.nan
            return Dataset(tilt=tilt, **common)
    raise AssertionError(f"no test data for {kind}")


@pytest.mark.parametrize("kind", OURS, ids=lambda k: k.__name__)
@pytest.mark.parametrize("per_session", [False, True])
@pytest.mark.parametrize("joints", [(), (0.5, 0.0, 1.0, 0.2, 2.0, 0.5)], ids=["exact", "noisy readings"])
def test_every_jacobian_column_is_the_derivative(aria, kind, per_session, joints):
    rng = np.random.default_rng(7)
    sessions = np.array(["front", "left"])[np.arange(ROWS) % 2] if per_session else None
    data = measured(aria, rng, kind.__name__, sessions=sessions)
    frames = FrameFreedom(
        FRAME_PARTS, FRAME_PARTS, base_per_session=per_session, tool_per_session=per_session
    )
    problem = Problem.build(aria, data, frames=frames, noise=Noise(1.0, 1.0, joints))
    check_problem(problem, rng)


def test_unknowns_of_another_package_s_observation_are_none_of_the_arm(aria, monkeypatch):
    """Whatever they are called: a scale under the tool reads its height above a floor of unknown place."""

    class Height(AbstractObservation):
        reading: np.ndarray
        channels = (Channel.POSITION,)
        unknowns = ("floor.z",)

        @classmethod
        def applies(cls, data):
            return np.ones(len(data), bool)

        @classmethod
        def of(cls, data):
            return cls(data.payload)

        def start(self, poses):
            return np.zeros(1)

        def linearise(self, poses, unknown):
            rows = len(poses)
            by_twist, by_unknown = np.zeros((rows, 1, 6)), np.full((rows, 1, 1), -1.0)
            by_twist[:, 0, 2] = 1.0
            return Linearised((self.reading - poses[:, 2, 3] + unknown[0])[:, None], by_twist, by_unknown)

    monkeypatch.setattr("workbench.identification.problem_blocks.OBSERVATIONS", {"Height": Height})
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (ROWS, aria.dof))
    data = Dataset(q=q, payload=tool_poses(aria, Motion(q))[:, 2, 3] + 0.3)
    problem = Problem.build(aria, data, free=(free := ("joint2.theta",)))
    x = Opt2().search(problem).x
    assert problem.instrument(x) == pytest.approx({"floor.z": -0.3}, abs=1e-6)
    assert [p.name for p in problem.parameters if p.is_geometry] == [*free]
    assert problem.robot_at(x).values(free) == pytest.approx(aria.values(free), abs=1e-6)


@pytest.mark.parametrize("kind", ["PoseObservation", "MarkerObservation", "TiltObservation"])
def test_rows_are_whitened_by_the_noise_of_their_joint_readings(aria, kind):
    """r'C⁻¹r row by row, the joints' columns by central differences; hidden markers count for nothing."""
    data = measured(aria, np.random.default_rng(2), kind)
    noise = Noise(1e-3, 2e-3, (1e-3, 0.0, 2e-3, 5e-4, 1e-3, 1e-3))
    plain = Problem.build(aria, data, free=(), noise=noise._replace(joints=()))
    problem = plain.with_noise(noise)
    residual, step = plain.physical(plain.residual(plain.start)), 1e-5
    known = dict(zip(plain.names, plain.start.tolist(), strict=True))

    def at(j, turn):
        rows = Problem.build(aria, replace(data, q=data.q + turn * np.eye(6)[j]), free=(), known=known)
        return rows.physical(rows.residual(rows.start))

    columns = np.stack([(at(j, step) - at(j, -step)) / (2 * step) for j in range(6)], axis=1)
    whitened, live = problem.residual(problem.start), plain.inverse_sigma > 0.0
    seen = [(problem.component_rows == i) & live for i in range(ROWS)]
    for i in range(ROWS):
        for block in problem.blocks:
            mine = seen[i] & (np.arange(problem.size) >= block.start) & (np.arange(problem.size) < block.stop)
            root = columns[mine] * np.array(noise.joints)
            covariance = np.diag(plain.inverse_sigma[mine] ** -2.0) + root @ root.T
            square = residual[mine] @ np.linalg.solve(covariance, residual[mine])
            assert (whitened[mine] ** 2).sum() == pytest.approx(square, rel=1e-5)
            np.testing.assert_allclose(problem.sigma[mine] ** 2, np.diag(covariance), rtol=1e-5)
    assert (whitened[~live] == 0.0).all()
    weighed = problem.with_row_weights(np.linspace(0.1, 1.0, ROWS))
    np.testing.assert_allclose(weighed.physical(weighed.residual(weighed.start)), residual, atol=1e-15)


def test_rows_choose_the_first_observation_that_fits(aria):
    rng = np.random.default_rng(0)
    data = measured(aria, rng, "PoseObservation")
    rotation = data.rotation.copy()
    rotation[:5] = np.nan
    problem = Problem.build(aria, replace(data, rotation=rotation))
    assert problem.size == 5 * 3 + (ROWS - 5) * 6
    assert set(problem.component_rows[problem.channels[1]]) == set(range(5, ROWS))


def test_noise_given_by_rows_comes_to_the_common_one(aria):
    data = measured(aria, np.random.default_rng(0), "PointObservation")
    sigma = np.full((ROWS, 6), np.nan)
    sigma[2, :3] = 0.01
    problem = Problem.build(aria, replace(data, sigma=sigma), noise=Noise(0.1, 1.0))
    weights = problem.inverse_sigma.reshape(ROWS, 3)
    np.testing.assert_allclose(weights[2], 1.0 / np.hypot(0.01, 0.1))  # what the model lacks comes on top
    np.testing.assert_allclose(weights[[0, 1, 3]], 10.0)


def test_prior_joins_the_residuals(aria):
    data = measured(aria, np.random.default_rng(0), "PointObservation")
    problem = Problem.build(aria, data)
    names = ("joint1.theta", "joint2.a")
    centre = aria.values(names) + 1.0
    prior = problem.with_prior(names, centre, np.diag([0.5, 1.0 / 3.0]))
    x = problem.start.copy()
    x[[problem.names.index(n) for n in names]] = centre + np.array([2.0, 3.0])
    extra = prior.residual(x)[problem.size :]
    assert extra @ extra == pytest.approx(2.0)
    assert prior.cost_and_gradient(x)[0] == pytest.approx(0.5 * prior.residual(x) @ prior.residual(x))
    with refuses(OptionError, option="prior", found="joint2.d"):
        problem.with_prior(("joint2.d",), np.zeros(1), np.eye(1))


def test_robot_at_moves_arm_and_session_frames(aria):
    rng = np.random.default_rng(3)
    sessions = np.array(["front", "left"])[np.arange(ROWS) % 2]
    data = measured(aria, rng, "PoseObservation", sessions=sessions)
    frames = FrameFreedom(FRAME_PARTS, FRAME_PARTS[:3], base_per_session=True)
    problem = Problem.build(aria, data, frames=frames)
    x = problem.start + rng.normal(0.0, 0.05, len(problem.start))
    moved = problem.robot_at(x)
    direct = problem.physical(problem.residual(x))
    again = Problem.build(moved, data, free=())
    np.testing.assert_allclose(again.physical(again.residual(again.start)), direct, atol=1e-12)
    assert list(moved.sessions) == ["front", "left"]


@pytest.mark.parametrize("kind", ["PoseObservation", "DistanceObservation"])
def test_a_problem_made_again_for_other_rows_keeps_what_is_free_and_what_is_known(aria, kind):
    data = measured(aria, np.random.default_rng(5), kind)
    known = {f"anchor[A].{axis}": value for axis, value in zip("xyz", (0.5, 0.1, 0.2), strict=True)}
    options = {"free": aria.joint_offsets, "frames": FrameFreedom(tool=FRAME_PARTS[:3]), "known": known}
    problem = Problem.build(aria, data, noise=Noise(2e-4), **options)
    some = data.take(np.arange(6))
    again, whole = problem.again(data=some), Problem.build(aria, some, noise=Noise(2e-4), **options)
    assert again.names == whole.names == problem.names
    x = again.at(problem.named(problem.start + 0.01))
    np.testing.assert_array_equal(x, problem.start + 0.01)
    np.testing.assert_array_equal(again.residual(x), whole.residual(x))
    np.testing.assert_array_equal(again.evaluate(x).jacobian, whole.evaluate(x).jacobian)
    assert problem.again(free=()).names == tuple(n for n in problem.names if "joint" not in n)

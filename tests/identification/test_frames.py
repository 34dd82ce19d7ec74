"""Base and tool: found in closed form, decided from the data, refused where they contradict the file."""

import generator
import numpy as np
import pytest
from checks import freed, with_errors
from slow import slow

from workbench import Dataset, Frame, Motion, evaluate, identify, load_robot, read_measurements, tool_poses
from workbench.arm.frame import FRAME_PARTS
from workbench.base import se3
from workbench.base.types import Freedom
from workbench.identification.alignment import align
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.frames import choose_frames
from workbench.identification.problem import FrameFreedom


def random_pose(rng, size=1.0):
    return se3.pose(se3.rotvec_to_matrix(rng.normal(0.0, 1.0, 3)), rng.normal(0.0, size, 3))


def rows_of(robot, rng, rows, noise=(0.0, 0.0), points=False):
    q = rng.uniform(-1.2, 1.2, (rows, robot.dof))
    poses = tool_poses(robot, Motion(q))
    position = poses[:, :3, 3] + rng.normal(0.0, 1.0, (rows, 3)) * noise[0]
    turn = se3.rotvec_to_matrix(rng.normal(0.0, 1.0, (rows, 3)) * noise[1])
    rotation = None if points else turn @ poses[:, :3, :3]
    return Dataset(q=q, row=np.arange(rows), position=position, rotation=rotation)


@pytest.mark.parametrize("points", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_alignment_finds_any_base_and_tool(seed, points):
    rng = np.random.default_rng(seed)
    robot = load_robot("ur5")
    turn = np.eye(3) if points else se3.rotvec_to_matrix(rng.normal(0.0, 1.0, 3))
    tool = se3.pose(turn, rng.normal(0.0, 0.1, 3))
    actual = robot.with_frames(base=Frame.from_pose(random_pose(rng)), tool=Frame.from_pose(tool))
    data = rows_of(actual, rng, 40, points=points)
    freedom = FrameFreedom(FRAME_PARTS, FRAME_PARTS[:3] if points else FRAME_PARTS)
    aligned = align(robot, data, freedom)
    np.testing.assert_allclose(tool_poses(aligned, Motion(data.q))[:, :3, 3], data.position, atol=1e-8)
    for found, true in ((aligned.base, actual.base), (aligned.tool, actual.tool)):
        np.testing.assert_allclose(found.pose, true.pose, atol=1e-7)


def test_known_frames_stay_where_the_data_agree_with_them():
    rng = np.random.default_rng(2)
    robot = freed(load_robot("aria"), Freedom.AUTO)
    values = {"joint2.a": 0.412, "joint4.theta": 0.02, "joint3.alpha": np.pi / 2 + 0.01}
    choice = choose_frames(robot, rows_of(robot.with_values(values), rng, 60, noise=(1e-4, 3e-4)))
    assert choice.freedom.base == ()
    assert choice.freedom.tool == ()
    assert "as given" in choice.notes[0]
    assert "decided" in choice.notes[0]


def test_moved_base_is_freed_and_said():
    rng = np.random.default_rng(3)
    robot = freed(load_robot("aria"), Freedom.AUTO)
    turn = se3.rpy_to_matrix(np.array([0.0, 0.0, np.pi]))
    turned = Frame.from_pose(se3.pose(turn, np.array([0.5, 0.2, 0.1])))
    choice = choose_frames(robot, rows_of(robot.with_frames(base=turned), rng, 60, noise=(1e-4, 3e-4)))
    assert choice.freedom.base == FRAME_PARTS
    assert any("180.0° about z" in note for note in choice.notes)


def in_sessions(robot, rng, count, rows, **more):
    parts = []
    for _ in range(count):
        placed = robot.with_frames(base=Frame.from_pose(random_pose(rng), Freedom.AUTO))
        parts.append(rows_of(placed, rng, rows, noise=(1e-4, 3e-4), **more))
    columns = {name: [getattr(part, name) for part in parts] for name in ("q", "position", "rotation")}
    whole = {name: np.concatenate(own) for name, own in columns.items() if own[0] is not None}
    return Dataset(**whole, session=np.repeat([f"s{k}" for k in range(count)], rows))


def test_sessions_with_their_own_base_are_recognised():
    robot = freed(load_robot("panda"), Freedom.AUTO)
    choice = choose_frames(robot, in_sessions(robot, np.random.default_rng(5), 3, 25))
    assert (choice.freedom.base_per_session, choice.freedom.tool_per_session) == (True, False)
    assert set(choice.robot.sessions) == {"s0", "s1", "s2"}


@pytest.mark.parametrize("rows", [slow(4), 3])
def test_sessions_of_few_points_keep_those_that_place_them(rows):
    """With fewer than three the base is open: errors of a metre were held out, good rows were outliers."""
    nominal, rng = freed(load_robot("ur10e"), Freedom.AUTO), np.random.default_rng(3)
    data = in_sessions(with_errors(nominal, 2e-3), rng, 15, rows, points=True)
    found = identify(nominal, data)
    before, after = (errors.position_mm.mean for errors in found.error)
    assert (found.outlying.size, after < 0.4 * before < 20.0) == (0, True)


@pytest.mark.data
@pytest.mark.parametrize(
    ("file", "robot", "size"),
    [("ur10_rotvec_missing_outlier.csv", "ur10", 2.0), ("ur5_plain.xlsx", "ur5", 2.0)],
)
def test_few_rows_or_an_outlier_do_not_bend_the_arm(file, robot, size, shared_data):
    """An unknown base and tool go into the frames, not into the arm, however little the rows say."""
    data = read_measurements(shared_data / "importer_variants" / file)
    data = data.take(data.included)
    choice = choose_frames(load_robot(robot), data)
    assert len(choice.freedom.base) == 6
    assert choice.freedom.tool
    assert 1e3 * np.median(row_errors(choice.robot, data).position) < size


@pytest.mark.parametrize("seed", range(3))
def test_a_reflector_off_the_flange_is_no_error_of_the_wrist_where_orientations_are_few(seed):
    rng = np.random.default_rng(seed)
    arm = freed(load_robot("ur5"), Freedom.AUTO)
    q = np.hstack(
        [rng.uniform(-0.6, 0.6, (80, 3)), rng.choice([-0.004, 0.004], (80, 3)) + np.array([0.5, 1.2, 0.3])]
    )
    tool = Frame.from_pose(se3.pose(np.eye(3), [0.2, 0.0, 0.1]))
    errors = rng.normal(0.0, 1e-3, len(arm.default_free))
    position = tool_poses(with_errors(arm, errors).with_frames(tool=tool), Motion(q))[:, :3, 3]
    data = Dataset(q=q, row=np.arange(80), position=position + rng.normal(0.0, 1e-3, (80, 3)))
    assert choose_frames(arm, data).freedom.tool


def test_both_doors_find_the_tool_at_a_draw_wire_where_fits_of_the_arm_wander():
    """One wire, and 3 mm that no constant explains: the arm's constants take any tool, implausibly."""
    rng, tool = np.random.default_rng(1), [0.002, -0.009, 0.07]
    arm = generator.aria().perturbed(rng, length=1e-3, angle=2e-3)
    q = np.array([0.3, -0.6, 0.8, 0.2, 0.7, 0.1]) + rng.uniform(-1, 1, (300, 6)) * (
        [0.8, 0.5, 0.5] + [0.2] * 3
    )
    wire = np.linalg.norm((arm.pose(q) @ [*tool, 1.0])[:, :3] - [0.2, -0.47, -0.06], axis=1)
    off = 3e-3 * np.sin(3.0 * q[:, 0] + 2.0 * q[:, 1]) + rng.normal(0.0, 2e-4, 300)
    data, robot = Dataset(q=q, distance=wire + off), freed(load_robot("aria"), Freedom.AUTO)
    for found in (identify(robot, data).aligned, evaluate(robot, data, fit_frames=True).robot):
        assert np.abs(found.tool.xyz - tool).max() < 0.02

"""A virtual UR5 measured with one reflector: whatever is saved improves its positions and spoils nothing.

The arm, its errors and every judge are plain numpy; of the package's own code only files come here.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import round_trip as trip
from checks import with_errors
from generator import three_parallel
from refusals import refuses

import workbench as wb
from tests.exports import readers
from workbench import Dataset, Trajectory
from workbench.arm.usable_arm import closest
from workbench.base.errors import OptionError
from workbench.exports import FORMS, Job, export_robot
from workbench.exports.controller_parameters import use_of

ERROR, NOISE, ROWS = 4e-4, 3e-5, 200
BASE = trip.placed([1.0, 0.5, 0.2], [0.0, 0.0, 0.7])


def flanges(q: np.ndarray, errors: np.ndarray | None = None) -> np.ndarray:
    """Flanges in the arm's base; errors are x y z roll pitch yaw behind every joint."""
    here = np.eye(4)
    for k, (before, driven, after) in enumerate(three_parallel().parts(q)):
        behind = np.eye(4) if errors is None else trip.placed(errors[k, :3], errors[k, 3:])
        here = here @ before @ driven @ after @ behind
    return here


def angles(a: np.ndarray, b: np.ndarray) -> float:
    """Mean angle between orientations [°]."""
    return float(np.rad2deg(trip.angle(a, b)).mean())


def distances(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance [mm]."""
    return 1e3 * float(np.linalg.norm(a - b, axis=1).mean())


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance [mm] on the best base: where the arm stands, its rows can't tell."""
    best = trip.aligned(a, b)
    return distances(a @ best[:3, :3].T + best[:3, 3], b)


@dataclass(frozen=True)
class Cell:
    """An arm with errors, its reflector, and joint positions near those that were measured."""

    errors: np.ndarray
    reflector: np.ndarray
    q: np.ndarray
    saved: str

    def flanges(self, q: np.ndarray) -> np.ndarray:
        return flanges(q, self.errors)

    def points(self, q: np.ndarray) -> np.ndarray:
        """Of the reflector in the measuring frame."""
        return (BASE @ self.flanges(q) @ self.reflector)[:, :3]

    def judge(self, found: np.ndarray) -> None:
        """Flanges of a model: orientations as good as the nominal ones, positions better."""
        nominal, actual = flanges(self.q), self.flanges(self.q)
        assert angles(found, actual) < 1.1 * angles(nominal, actual)
        assert distances(found[:, :3, 3], actual[:, :3, 3]) < distances(nominal[:, :3, 3], actual[:, :3, 3])

    def judge_corrected(self, q: np.ndarray, tool: np.ndarray) -> None:
        """Corrected joints: the real flange is turned as before, the reflector where it was meant to be."""
        wanted, before, after = flanges(self.q), self.flanges(self.q), self.flanges(q)
        assert angles(after, wanted) < 1.1 * angles(before, wanted)
        missed = [distance((t @ self.reflector)[:, :3], (wanted @ tool)[:, :3]) for t in (before, after)]
        assert missed[1] < 0.3 * missed[0]
        assert np.abs(q - self.q).max() < 0.02


def measured(rng: np.random.Generator) -> np.ndarray:
    """A tool that keeps pointing down, more or less, over a table: the last joints hardly vary."""
    centre = np.array([0.1, -1.2, 1.9, -2.2, -1.5, 0.3])
    return centre + rng.uniform(-1.0, 1.0, (ROWS, 6)) * [0.7, 0.4, 0.4, 0.35, 0.3, 0.5]


@pytest.fixture(scope="module", params=[(0, 0.02, np.inf), (1, 0.03, np.inf), (2, 0.05, "auto")], ids=str)
def cell(request, tmp_path_factory) -> Cell:
    seed, off_axis, deviation = request.param
    rng = np.random.default_rng(seed)
    errors = rng.normal(0.0, ERROR, (6, 6))
    reflector, q = np.array([off_axis, 0.0, 0.02 - 0.0823, 1.0]), measured(rng)
    path = tmp_path_factory.mktemp("saved") / "calibrated.toml"
    made = Cell(errors, reflector, measured(rng)[:60], str(path))
    point = made.points(q) + rng.normal(0.0, NOISE, (ROWS, 3))
    rows = Dataset(q=q, row=np.arange(ROWS), position=point, source="reflector.csv")
    wb.identify(wb.load_robot("ur5"), rows, algorithms=("ols",), deviation=deviation).robot.save(path)
    return made


def trajectory(q: np.ndarray) -> Trajectory:
    return Trajectory(source="t.csv", q=q, time=None, position=None, rotation=None, notes=())


@pytest.mark.extra("trajectories")
def test_a_corrected_trajectory_leaves_orientations_as_they_were(cell):
    arm, nominal = wb.load_robot(cell.saved), wb.load_robot("ur5")
    found = wb.compensate(arm, trajectory(cell.q), nominal=nominal)
    cell.judge_corrected(found.q, np.append(found.commanded.calibrated.tool.xyz, 1.0))
    assert any("orientations" in note and "not measured" in note for note in found.notes)
    with refuses(OptionError, "measured", option="positions_only"):
        wb.compensate(arm, trajectory(cell.q), nominal=nominal, positions_only=False)


def test_a_urdf_is_good_at_the_reflector_and_no_worse_at_the_flange(cell, tmp_path):
    path = wb.load_robot(cell.saved).save(tmp_path / "arm.urdf")
    flange, tool = trip.urdf_arm(Path(path).read_text())(trip.rows_of(cell.q))
    assert distances(tool[:, :3, 3], cell.points(cell.q)) < 0.06
    cell.judge(flange)


def test_a_joint_table_is_no_worse_at_the_flange(cell, tmp_path):
    path, job = tmp_path / "arm.csv", Job(robot=wb.load_robot(cell.saved), nominal=wb.load_robot("ur5"))
    done = export_robot(FORMS["dh-csv"], path, job)
    assert any("not measured" in note for note in done.notes)
    assert done.position < 2e-5
    pose = readers.spreadsheet(path.read_text())
    cell.judge(np.array([pose(row) for row in cell.q]))


def test_controller_numbers_that_turn_an_unmeasured_tool_are_not_advised(cell):
    arm, nominal = wb.load_robot(cell.saved), wb.load_robot("ur5")
    for variant in use_of(arm, nominal).variants:
        noticed = variant.after.rotation_mean > 1.02 * variant.before.rotation_mean + 3.4e-4
        assert not (noticed and variant.is_better)
        assert any("not measured" in note for note in variant.notes)


def test_no_step_runs_away_along_what_only_rounding_tells():
    """Heights of a SCARA's base and tool differ by rounding: its URDF stayed nominal, and was not written."""
    arm, names = wb.load_robot("aria"), ("base.z", "tool.z")
    start, jacobian = arm.values(names), np.array([1e4, -1e4 * (1.0 + 1e-12)]) * np.ones((60, 1))
    jacobian[:, 1] += 1e-8 * np.random.default_rng(0).normal(size=60)

    def at(moved):
        x = moved.values(names) - start
        return 10.0 - jacobian @ x - 1e4 * x[0] ** 2, jacobian

    assert closest(arm, names, at, prior=np.zeros(2)).values(names) - start == pytest.approx(
        [5e-4, -5e-4], rel=0.01
    )


def test_a_urdf_keeps_the_tool_that_was_measured():
    """A constant turn of the tool made uncertain orientations of a URDF worse than nominal."""
    rng, robot = np.random.default_rng(1), wb.load_robot("ur5e")
    names, q = robot.joint_offsets, rng.uniform(-1.5, 1.5, (30, 6))
    poses = wb.tool_poses(with_errors(robot, np.deg2rad(1.5) * rng.normal(size=6), names), q)
    poses = poses @ trip.placed([0.02, 0.01, 0.1], [0.3, 0.2, 0.1])
    position = poses[:, :3, 3] + 3e-3 * rng.normal(size=(30, 3))
    rotation = np.array(
        [trip.placed(np.zeros(3), r)[:3, :3] for r in np.deg2rad(1.2) * rng.normal(size=(30, 3))]
    )
    data = Dataset(q=q, position=position, rotation=rotation @ poses[:, :3, :3])
    robot = robot.with_frames(tool=replace(robot.tool, free="free"))
    found = wb.identify(robot, data, frames="shared").best.file_errors
    assert found["URDF"].expected.rotation < 1.05 * found["TOML"].expected.rotation

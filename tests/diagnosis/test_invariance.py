"""What says nothing about the arm changes no verdict: the order of rows, units, the measuring frame."""

import numpy as np
import pytest
from arms import make
from scipy.spatial.transform import Rotation
from slow import slow

from workbench import Frame, diagnose, read_measurements
from workbench.base import se3

KINDS = (slow("none"), slow("two"), "harmonic-3")
SEED = 5


def result(found):
    """Everything that is claimed, with sizes to a hundredth."""
    causes = sorted((c.kind, c.joints, c.confidence) for c in found.causes)
    sizes = found.robot.coefficients
    return found.verdict, causes, sizes


def agree(one, other):
    assert one[:2] == other[:2]
    assert one[2] == pytest.approx(other[2], rel=0.05, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_another_order_frame_and_units(kind, tmp_path):
    case = make(kind, SEED, free_frames=True)
    order = np.random.default_rng(0).permutation(len(case.data))
    moved = se3.pose(Rotation.from_rotvec([0.7, -1.1, 2.0]).as_matrix(), np.array([1.5, -2.0, 0.4]))
    data, file = case.data.take(order), tmp_path / "rows.csv"
    joints = [f"q{i + 1}[deg]" for i in range(data.joints)]
    heading = [*joints, "x[in]", "y[in]", "z[in]", "rx[deg]", "ry[deg]", "rz[deg]"]
    turns = Rotation.from_matrix(moved[:3, :3] @ data.rotation).as_rotvec(degrees=True)
    table = np.hstack([np.rad2deg(data.q), se3.apply(moved, data.position) / 0.0254, turns])
    for name, unit in (("time", "min"), ("temperature", "K"), ("payload", "g")):
        values = getattr(data, name)
        if values is not None:
            heading.append(f"{name}[{unit}]")
            scaled = {"min": values / 60, "K": values + 273.15, "g": 1e3 * values}[unit]
            table = np.column_stack([table, scaled])
    heading += [f"direction{i + 1}" for i in range(data.joints)]
    table = np.hstack([table, data.direction])
    np.savetxt(file, table, delimiter=",", header=",".join(heading), comments="", fmt="%.17g")
    base = Frame.from_pose(moved @ case.robot.base.pose, case.robot.base.free)
    found = diagnose(case.robot.with_frames(base=base), read_measurements(file), held_out=0.0)
    agree(result(found), result(diagnose(case.robot, case.data, held_out=0.0)))

"""The real UR5 after a diagnosis: a format that can't hold effects gets the geometry that is best without."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

import workbench as wb
from tests.exports import readers
from workbench.identification.errors.file_errors import file_text


@pytest.fixture(scope="module")
def diagnosed(shared_data):
    folder = shared_data / "ur5_jacobi"
    arm = wb.load_robot(folder / "robot.toml")
    return wb.diagnose(arm, wb.read_measurements(folder / "measurements.csv", joints=arm.dof))


def points(path, q: np.ndarray) -> np.ndarray:
    """Where a URDF has the last link of its chain."""
    root = ET.parse(path).getroot()
    nodes = {node.find("parent").get("link"): node for node in root.findall("joint")}
    first = next(iter(nodes.keys() - {n.find("child").get("link") for n in nodes.values()}))
    out = []
    for row in q:
        here, name, angles = np.eye(4), first, iter(row)
        while (node := nodes.get(name)) is not None:
            place = [float(v) for k in ("xyz", "rpy") for v in node.find("origin").get(k).split()]
            here = here @ readers.origin(*place)
            if node.get("type") != "fixed":
                axis = [float(v) for v in node.find("axis").get("xyz").split()]
                here = here @ readers.rot(int(np.argmax(axis)), next(angles))
            name = node.find("child").get("link")
        out.append(here[:3, 3])
    return np.array(out)


@pytest.mark.slow
@pytest.mark.data
def test_a_urdf_after_a_diagnosis_is_as_good_as_geometry_alone(diagnosed, tmp_path):
    saved = wb.load_robot(diagnosed.robot.save(tmp_path / "whole.toml"))
    data = diagnosed.data
    missed = 1e3 * np.linalg.norm(points(saved.save(tmp_path / "arm.urdf"), data.q) - data.position, axis=1)
    geometry = diagnosed.before.held_out.position_mm.mean
    assert diagnosed.after.held_out.position_mm.mean < 0.6 * geometry
    assert missed.mean() < 1.05 * geometry
    run = diagnosed.identification().best
    shown = run.file_errors
    assert shown["URDF"].position_mm.mean == pytest.approx(missed.mean(), rel=0.05)
    assert shown["TOML"].position_mm.mean == diagnosed.after.held_out.position_mm.mean
    text = file_text(run)
    assert text.index("URDF") < text.index("TOML")

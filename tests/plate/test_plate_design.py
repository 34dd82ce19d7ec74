"""Rows that are read at targets of each kind; plates of every kind designed."""

from dataclasses import replace

import numpy as np
import pytest
from checks import any_joints
from slow import slow

import workbench as wb
from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.base import se3
from workbench.plate.design import NARROW
from workbench.plate.plate import Kind
from workbench.plate.plate_toml import read_plate
from workbench.plate.target_readings import linearise_targets
from workbench.plate.tolerances import Production
from workbench.session.start import default_circle

pytestmark = pytest.mark.usefixtures("short_polish")


def test_a_target_s_own_error_adds_to_the_reading_s(aria, plate):
    """Table 2 with five sockets, made to a tolerance: rows of six and of three, each over its deviation."""
    made = replace(plate, production=Production(tolerance=(5e-5, 1e-4)))
    kinds = [Kind.SEAT] * 5 + [Kind.SOCKET] * 5
    made = replace(made, targets=tuple(replace(t, kind=k) for t, k in zip(made.targets, kinds, strict=True)))
    q = any_joints(aria, 10, seed=1)
    found = linearise_targets(aria, made, q, sigma=(1e-4, 3e-4))
    _, twists = wb.identification_jacobian(aria, wb.Motion(q))
    assert np.bincount(found.measurement).tolist() == [6] * 5 + [3] * 5
    for row, (k, kind) in enumerate(zip(range(10), kinds, strict=True)):
        own, height = found.measurement == row, made.heights[k]
        turn = 1e-4 / np.sqrt(3.0)
        place = np.sqrt(25e-10 / 3.0 + 2.0 / 3.0 * (height * turn) ** 2)
        sigma = np.repeat([np.hypot(1e-4, place), np.hypot(3e-4, turn)], 3)[: 6 if kind is Kind.SEAT else 3]
        assert np.allclose(found.jacobian[own], twists[k, : len(sigma)] / sigma[:, None], rtol=1e-12)


@pytest.mark.parametrize("kind", [slow(Kind.SOCKET), Kind.POINT])
def test_plates_of_every_kind_are_designed(kind, aria, plate, tmp_path):
    bare = replace(plate, targets=())
    design = wb.optimise_plate(aria, bare, kind=kind, number=7, places=12, starts=1, seed=1)
    assert np.isfinite(design.cost)
    assert len(design.plate) == 7
    assert design.clearance.min() >= 0.01 - 1e-9
    assert {t.kind for t in design.plate.targets} == {kind}
    again = read_plate(wb.write_plate(design.plate, tmp_path / "plate.toml"))
    q = np.stack([t.q for t in again.targets])
    assert np.allclose(wb.tool_poses(aria, wb.Motion(q)), design.plate.poses, atol=1e-6)


def test_blocks_for_balls_face_an_arm_of_five_joints():
    """No search had a solution: the arm was asked for the direction of every random block."""
    katana = wb.load_robot("katana450")
    plate = default_circle(katana)
    margins = replace(NARROW, floor=-height_above_floor(katana))
    found = wb.optimise_plate(katana, plate, number=5, places=30, starts=1, constraints=margins).plate
    assert {target.kind for target in found.targets} == {Kind.SOCKET}
    at = se3.inverse(katana.base.pose) @ wb.tool_poses(
        katana, wb.Motion(np.stack([t.q for t in found.targets]))
    )
    assert np.allclose(at[:, :3, 3], found.poses[:, :3, 3], atol=1e-6)
    assert np.allclose(at[:, :3, 2], found.poses[:, :3, 2], atol=1e-6)

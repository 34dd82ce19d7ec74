"""The score of the Table 2 plate against the paper's formulas written out anew, and what freedom costs."""

from dataclasses import replace

import generator
import numpy as np
import pytest

import workbench as wb
from workbench.arm.linearisation import linearise
from workbench.plate.free_constants import identified_names, visible, visible_basis
from workbench.plate.plate import Target
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.report.plates import score_json

# theta, d, a, alpha, beta of ARIA Table 1; beta of joint 2 is free instead of d, as axes 2 and 3 are parallel
TABLE_1 = generator.aria().table
FREE = [(i, k) for i in range(6) for k in range(5) if k != (1 if i == 1 else 4)]


def forward(q, table=TABLE_1):
    """ARIA eqs. (7), (8)."""
    return generator.VirtualArm("hayati", table).pose(q)[0]


def jacobian(q, step=1e-6):
    """ARIA eq. (12) by central differences, with the orientation error of eq. (16)."""
    columns = []
    for i, k in FREE:
        moved = []
        for sign in (1, -1):
            table = TABLE_1.copy()
            table[i, k] += sign * step
            moved.append(forward(q, table))
        half = (moved[0] - moved[1]) / (2 * step)
        spin = half[:3, :3] @ forward(q)[:3, :3].T
        columns.append([*half[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]])
    return np.array(columns).T


@pytest.fixture(scope="module")
def score(aria, plate):
    return wb.score(aria, plate)


def test_table_2_is_reached_and_its_o_is_that_of_the_papers_formulas(score, plate):
    for part in (score.measured, score.single):
        poses = np.stack([forward(q) for q in part.q])
        assert np.allclose(poses, plate.poses, atol=1e-8)
        blocks = np.stack([jacobian(q) for q in part.q])
        values = np.linalg.svd(blocks, compute_uv=False)
        assert np.allclose(part.per_target, values[:, -1] / values[:, 0], rtol=1e-6)
        assert part.indices["O"] == pytest.approx((values[:, -1] / values[:, 0]).mean(), rel=1e-6)
        stacked = np.linalg.svd(np.concatenate(blocks), compute_uv=False)
        assert part.stacked == pytest.approx(stacked[-1] / stacked[0], rel=1e-6)
        assert part.rank == 24


def test_indices_and_predicted_error_of_table_2(score, aria):
    """O1 … O5 from the singular values of the scaled, whitened Jacobian; I from the predicted error."""
    for part in (score.measured, score.single):
        sigma = np.repeat([1e-4, np.deg2rad(0.02)], 3)[:, None]
        angles = np.array([k in (0, 3, 4) for _, k in FREE])
        scaled = np.concatenate([jacobian(q) / sigma for q in part.q]) / np.where(angles, aria.reach, 1.0)
        s = np.linalg.svd(scaled, compute_uv=False)
        expected = {
            "O1": np.exp(np.log(s).mean()) / np.sqrt(10),
            "O2": s[-1] / s[0],
            "O3": s[-1],
            "O4": s[-1] ** 2 / s[0],
            "O5": 1 / (1 / s).sum(),
            "I": 1 / part.error.position_rms,
        }
        assert {name: part.indices[name] for name in expected} == pytest.approx(expected, rel=1e-5)


def test_free_frames_leave_open_what_the_plate_cannot_tell(aria, plate):
    """All targets of Table 2 keep the tool's x axis along the base's: a shift of either looks the same."""
    found = wb.score(aria, plate, base=True, tool=True).measured
    assert (found.rank, found.visible, len(found.names)) == (29, 30, 36)
    assert np.isnan(found.shares).all()  # of an index that is 0
    assert found.indices["O1"] == found.indices["I"] == 0.0
    open_ones = {n for n, w in zip(found.names, found.open[:, 0], strict=True) if abs(w) > 1e-6}
    assert open_ones == {"base.x", "tool.x", "joint6.a"}
    varied = replace(
        plate,
        targets=tuple(
            replace(t, rpy=t.rpy + np.array([0, 0, 0.3 * (k - 5)])) for k, t in enumerate(plate.targets)
        ),
    )
    better = wb.score(aria, varied, base=True, tool=True).measured
    assert better.rank == better.visible == 30
    assert better.indices["O1"] > 0
    assert np.isfinite(better.error.position_rms)


def test_the_visible_basis_drops_only_what_no_pose_shows(aria):
    assert visible_basis(aria) is None
    names = identified_names(aria, base=True)
    basis = visible_basis(aria, names)
    assert basis.shape == (30, 28)
    q = np.random.default_rng(1).uniform(-1, 1, (12, 6))
    whole = linearise(aria, q, names=names)
    seen = visible(whole, basis)
    assert seen.rank() == whole.rank() == 28
    assert np.allclose(seen.singular_values, whole.singular_values[:28], rtol=1e-9)


def test_a_target_out_of_reach_is_counted_out_and_told(aria, plate, score):
    away = replace(plate, targets=(Target(np.array([2.0, 0.0, 0.0])), *plate.targets))
    found = wb.score(aria, away, evaluation_poses=plate_region_poses(aria, plate))
    assert found.measured.error.position_rms == pytest.approx(score.measured.error.position_rms, rel=1e-6)
    assert np.isnan(found.measured.per_target[0])
    message = "1 of 11 targets of Table 2 can't be measured (target 1 is out of reach: "
    assert found.left_out.startswith(message)
    assert found.left_out.endswith("; the figures are of the other 10")
    assert "can't be measured (target 1 is out of reach" in " ".join(repr(found).split())
    assert score_json(found)["targets"][0]["out_of_reach"] == found.can.away[0] != ""

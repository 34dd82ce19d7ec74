"""What is said of what is left, where the rows know their noise, their groups or nothing at all."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

import workbench as wb
from workbench.arm.effects.encoder_scale import EncoderScale
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.arm.motion import Motion
from workbench.arm.robot_toml import read_toml
from workbench.diagnosis.claims.cause import Cause, ResidualMap, largest_first
from workbench.diagnosis.claims.structure import Structure
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.gravity_direction import GravityDirection
from workbench.diagnosis.remaining_error import RemainingError
from workbench.diagnosis.result import Verdict
from workbench.diagnosis.verdict import conclude
from workbench.identification.errors.row_errors import Errors, Spread, explains_little
from workbench.identification.problem import Noise
from workbench.plate.simulated_measurement import measure_poses

NOISE_ONLY = RemainingError(
    noise=Noise(1e-4, 1e-3), known_noise=None, joint_noise=None, structure=Structure(), distrusted=()
)
SLIDING = """
name = "column"
convention = "dh"
[[joint]]
type = "prismatic"
alpha = 1.2
[[joint]]
a = 0.3
"""


@pytest.fixture(scope="module")
def soft():
    """An ARIA that gives way in joint 2, measured with a noise that its rows state."""
    return wb.load_robot("aria"), measure_poses(
        wb.load_robot("aria"), 40, effects=("joint-compliance:2:5e-5",), seed=3
    )[1]


def named(found):
    return [(str(e.effect.name), e.effect.joints) for e in found.effects]


def test_what_is_left_is_compared_with_the_noise_that_rows_state(soft):
    robot, rows = soft
    found = diagnose(robot, rows, noise=Noise(1e-3, 1e-2))
    sigma = float(np.sqrt((rows.sigma[:, :3] ** 2).mean()))
    assert found.known_noise.position == pytest.approx(sigma)
    assert found.noise.position == pytest.approx(sigma, rel=0.2)
    assert found.verdict is Verdict.EXPLAINED
    doubted = diagnose(robot, replace(rows, sigma=rows.sigma / 3.0))
    assert doubted.verdict is Verdict.PARTLY
    assert "times what the known noise" in doubted.message


def test_rows_of_one_group_are_cross_validated_one_by_one(soft):
    robot, rows = soft
    found = diagnose(robot, replace(rows, group=np.full(len(rows), "all")), held_out=0.0)
    assert named(found) == [("joint-compliance", (1,))]
    assert sum("cross-validated row by row" in note for note in found.notes) == 1


def test_no_effect_is_added_where_the_geometry_explains_little(soft):
    """One robot moved twice, taken for one that stood still."""
    robot, rows = soft
    away = np.repeat([[0.0, 0.0, 0.0], [0.0, 0.2, 0.0]], len(rows) // 2, axis=0)
    found = diagnose(robot, replace(rows, position=rows.position + away, sigma=None))
    assert found.verdict is Verdict.UNEXPLAINED
    assert "No effects were added" in found.message
    assert found.effects == ()
    assert found.calibrated.effects == ()


def test_nothing_is_certain_where_structure_could_not_be_tested(soft, monkeypatch):
    """What fails beside a result costs a warning; what rests on it must not be called certain then."""
    assert diagnose(*soft).causes[0].confidence == Confidence.CERTAIN
    monkeypatch.setattr("workbench.diagnosis.diagnose.structure_of", lambda *_: 1 / 0)
    found = diagnose(*soft)
    assert found.causes[0].confidence == Confidence.PROBABLE
    assert found.causes[0].doubt
    assert "structure" in found.warnings[0]
    untested = diagnose(soft[0], replace(soft[1], sigma=None))
    assert mentions(untested.message, "could not be tested")
    assert not mentions(untested.message, "too few rows")


@pytest.mark.parametrize(("count", "looked"), [(18, False), (40, True)])
def test_structure_that_was_not_looked_for_is_not_denied(soft, count, looked):
    robot, rows = soft
    found = diagnose(robot, replace(rows.take(np.arange(count)), sigma=None), held_out=0.0)
    assert bool(found.structure.tests) is looked
    assert ("shows no structure" in found.message) is looked


@pytest.mark.parametrize(
    ("effect", "text"),
    [
        (EncoderScale((0,), (0.005,)), "Joint 1 slides 0.5 % too far"),
        (JointCompliance((0,), (2e-6,)), "Joint 1 deflects by 2 µm/N under the force along its axis"),
        (JointCoupling((0, 1), (1e-3,)), "Joint 1 moves along with joint 2: 0.001 mm/mrad of its angle"),
        (JointCoupling((1, 0), (1e-3,)), "Joint 2 moves along with joint 1: 0.001 mrad/mm of its travel"),
        (
            LocalJointError((0,), (-1e-3, 0.0, 1e-3), knots=(0.0, 0.1, 0.2), range=(0.0, 0.2)),
            "up to 1 mm that no other effect explains",
        ),
        (EncoderScale((1,), (-0.005,)), "Joint 2 turns 0.5 % too little"),
    ],
)
def test_sliding_joints_slide(tmp_path, effect, text):
    path = tmp_path / "column.toml"
    path.write_text(SLIDING)
    rows = Motion(np.column_stack([np.linspace(0.0, 0.2, 9), np.linspace(-1.0, 1.0, 9)]))
    assert text in effect.sentence(read_toml(path).chain, rows)


@pytest.mark.parametrize(("angle", "reduces"), [(0.05, True), (0.5, False)])
def test_without_positions_orientations_say_whether_an_effect_helps(soft, angle, reduces):
    """Errors [deg]: 2 nominal, 0.1 with the geometry alone, then with an effect; nothing of positions."""
    robot, _ = soft
    unmeasured = Spread.of(np.zeros(0))
    nominal, before, after = (Errors(unmeasured, Spread.of(np.full(5, size))) for size in (2.0, 0.1, angle))
    effect = JointCompliance((1,), (5e-5,))
    cause = Cause(effects=(effect,), odds=100.0, contribution_mm=np.nan, text="it gives way", look_alikes=())
    _, message = conclude([cause], None, NOISE_ONLY, robot=robot, nominal=nominal, before=before, after=after)
    assert ("not reduce" not in message) is reduces
    residual_map = ResidualMap(effects=(effect,), before=before, after=after, beside_causes=False)
    assert residual_map.is_better is reduces
    assert explains_little(nominal, nominal, robot.reach)
    assert not explains_little(nominal, Errors(unmeasured, Spread.of(np.full(5, 0.05))), robot.reach)


def test_what_the_geometry_has_already_reduces_nothing(soft):
    """The direction of gravity is identified with the geometry, so nothing is added for it."""
    robot, _ = soft
    nominal, found = (Errors(Spread.of(np.full(5, size)), None) for size in (2.0, 0.1))
    tilted = Cause(
        effects=(GravityDirection((), (0.01, 0.0)),),
        odds=100.0,
        contribution_mm=1.0,
        text="The arm is tilted",
        look_alikes=(),
        is_added=False,
    )
    verdict, message = conclude(
        [tilted], None, NOISE_ONLY, robot=robot, nominal=nominal, before=found, after=found
    )
    assert verdict is Verdict.EXPLAINED
    assert not mentions(message, "adding")
    _, message = conclude(
        [tilted], None, NOISE_ONLY, robot=robot, nominal=nominal, before=nominal, after=nominal
    )
    assert mentions(message, "No effects were added")


def test_all_arms_are_compared_on_the_same_rows(soft):
    """Three rows are so little off that they show only beside the effect: then no arm is judged by them."""
    robot, rows = soft
    off = rows.position.copy()
    off[[4, 17, 30]] += [0.0, 0.0, 1e-3]
    found = diagnose(robot, replace(rows, position=off), held_out=0.0)
    assert {4, 17, 30} <= set(found.outliers.tolist())
    assert found.before_fit.problem.data.row.size > found.after_fit.problem.data.row.size
    compared = found.nominal_rows[0], found.before_rows[0], found.after_rows[0]
    assert {len(each.position) for each in compared} == {len(rows) - len(found.outliers)}
    for errors, each in zip((found.nominal, found.before, found.after), compared, strict=True):
        assert errors.train.position_mm.mean == pytest.approx(1e3 * each.position.mean())


def test_causes_stand_largest_first(soft):
    (cause,) = diagnose(*soft).causes
    sizes = (0.2, np.nan, 0.5)
    ordered = largest_first(*(replace(cause, contribution_mm=size) for size in sizes))
    assert [c.contribution_mm for c in ordered[:2]] == [0.5, 0.2]

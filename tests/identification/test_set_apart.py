"""Wrong rows do not bend the arm, and are the first thing that is said; right rows all count."""

from dataclasses import replace

import generator
import numpy as np
import pytest
from refusals import refuses

from workbench import Dataset, Frame, evaluate, identify, load_robot, read_measurements
from workbench.base.errors import OptionError
from workbench.base.types import Freedom
from workbench.identification.report.results_json import identification_json


def rows_of(seed, count=100, noise=5e-5, turn=2e-4):
    """Poses of a hidden ARIA, from code that shares nothing with the package."""
    rng = np.random.default_rng(seed)
    arm = generator.aria().perturbed(rng, length=1e-3, angle=1e-3)
    q = arm.random(rng, count)
    return Dataset(q, *arm.measure(q, rng, noise, turn))


def wrong(rows, row, off):
    position = rows.position.copy()
    position[row] += off
    return replace(rows, position=position)


def test_a_row_that_lacks_a_joint_may_be_excluded_again():
    rows = rows_of(1)
    q = rows.q.copy()
    q[5, 2] = np.nan
    lacking = replace(rows.kept_out({5: "lacks q3"}), q=q)
    found = identify(load_robot("aria"), lacking, algorithms=("opt2",), exclude=[5])
    assert dict(found.excluded)[5] == "lacks q3"


@pytest.mark.parametrize(("apart", "count"), [(0.02, 45), (0.2, 100), (0.0, 18), (0.0, 100)])
def test_labels_are_points_of_the_tool_where_the_rows_say_so(apart, count):
    """One reflector at each posture, and one wrong row; or labels of the rows alone."""
    rows = rows_of(1, count)
    names = np.array(list("ABC"))[np.arange(count) % 3]
    off = apart * (1.0 * (names == "B") - 1.5 * (names == "C"))
    places = rows.position + off[:, None] * rows.rotation[:, :, 2]
    places[4] += 0.3
    places = places @ [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]] + [3.0, 1.0, 0.2]
    robot = load_robot("aria").with_frames(base=Frame(free=Freedom.AUTO))
    found = identify(robot, replace(rows, position=places, rotation=None, point=names))
    assert (found.data.markers is not None) == (apart > 0.0), found.notes
    assert found.best.held_out.position_mm.median < 0.3


def test_a_row_far_beyond_the_others_of_a_calibrated_arm_is_named():
    """8 mm beside 0.1 mm were in the table alone."""
    rows = rows_of(1)
    arm = identify("aria", rows.take(np.arange(60)), algorithms=("opt2",), held_out=0.0).robot
    fresh = wrong(rows.take(np.arange(60, 100)), 7, 0.005)
    assert "row 67 (8.6" in " ".join(evaluate(arm, fresh).warnings)
    assert not evaluate(arm, rows.take(np.arange(60, 100))).warnings


@pytest.mark.parametrize("first", [1, 101])
def test_rows_have_the_numbers_that_their_file_gives_them(first):
    table = wrong(rows_of(1, 60), 37, 0.1).to_frame().assign(Nr=np.arange(first, first + 60).astype(str))
    rows, number = read_measurements(table), 37 if first == 1 else first + 37
    found, shown = identify("aria", rows, exclude=[number + 2]), evaluate("aria", rows)
    assert [row.row for row in found.outliers] == [number]
    assert dict(found.excluded) == {number: "gross outlier", number + 2: "by hand"}
    told = identification_json(found)["measurements"]  # counted from 0, whatever the file's numbers are
    assert (told["outliers"], {row["row"] for row in told["excluded"]}) == ([37], {37, 39})
    for text in (*found.warnings[:1], shown.warnings[0]):
        assert f"row {number} (" in text
        assert ("as in its 'Nr'" in text) == (first > 1)
    with refuses(OptionError, "can't exclude row 400", f"{rows.row[0]} … {rows.row[-1]}"):
        evaluate("aria", rows, exclude=[400])


@pytest.mark.parametrize("off", [(0.3, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, -0.002)])
def test_one_wrong_row_costs_nothing_and_is_named_first(off):
    clean = identify(load_robot("aria"), rows_of(1), algorithms=("opt2",))
    row = int(clean.data.row[clean.train_rows[7]])
    run = identify(load_robot("aria"), wrong(rows_of(1), row, off), algorithms=("opt2",))
    assert run.best.held_out.position_mm.mean < 1.15 * clean.best.held_out.position_mm.mean
    by_hand = identify(load_robot("aria"), rows_of(1), algorithms=("opt2",), exclude=[row])
    assert {tuple(one.held_out_data.row) for one in (run, by_hand)} == {tuple(clean.held_out_data.row)}
    assert [r.row for r in run.outliers] == [row]
    assert run.outliers[0].position == pytest.approx(np.linalg.norm(off), rel=0.1)
    assert str(row) in run.warnings[0]
    assert row in [r for r, _ in run.excluded]
    assert identification_json(run)["measurements"]["outliers"] == [row]
    assert row not in run.data.row[np.concatenate([run.train_rows, run.held_out_rows])]


@pytest.mark.parametrize("count", [1, 9, 15, 20])
def test_held_out_rows_stay_so_whichever_others_are_excluded(count):
    robot, rows = load_robot("aria"), rows_of(1)
    held = identify(robot, rows).held_out_data.row.tolist()
    fewer = identify(robot, rows, exclude=held[:count], set_apart=False)
    assert {*held[count:]} < {*fewer.held_out_data.row.tolist()}
    assert len(fewer.held_out_data) == round(0.2 * (len(rows) - count))


def test_base_and_tool_of_an_evaluation_are_those_of_the_other_rows():
    robot, rows = load_robot("aria"), rows_of(1)
    bad = wrong(rows, 7, 0.8)
    found, clean = (evaluate(robot, data, fit_frames=True) for data in (bad, rows))
    assert "row 7 (1.39e+03 mm" in evaluate(robot, bad).warnings[0]
    assert evaluate(robot, bad, exclude="6–8, 20").errors.position_mm.max < 20.0
    assert found.errors.position_mm.median == pytest.approx(clean.errors.position_mm.median, rel=0.02)
    assert found.errors.position[7] == pytest.approx(0.8 * np.sqrt(3.0), rel=0.02)
    assert [each.warnings and "row 7" in each.warnings[0] for each in (found, clean)] == [True, ()]


def test_a_moved_session_is_named_as_a_whole_where_errors_are_computed():
    rows = wrong(wrong(rows_of(7, 60), slice(20, 40), 0.05), 3, 0.1)
    moved, lone = evaluate("aria", replace(rows, session=np.repeat(list("ABC"), 20))).warnings[:2]
    assert moved.startswith("session 'B': base or tool moved, 87.7 mm")
    assert lone.startswith("row 3 (175 mm")


def test_clean_rows_are_left_alone():
    fits = (identify(load_robot("aria"), rows_of(seed), algorithms=("opt2",)) for seed in range(20))
    assert sum(len(fit.outliers) for fit in fits) <= 2  # one in a hundred fits


@pytest.mark.parametrize(("off", "spread"), [(5e-4, 0.01), (5e-3, 0.01), (-5e-3, 0.01), (-5e-3, 0.0)])
def test_rows_of_a_region_that_one_arm_explains_are_kept(off, spread):
    """Joint 2 is off at twelve rows far from all others; nominal is nearer to several postures: no file."""
    arm, rng, far = load_robot("ur10"), np.random.default_rng(0), np.arange(102) >= 90
    hidden = arm.values(arm.default_free) + rng.normal(0.0, 5e-4, len(arm.default_free))
    q = np.vstack([rng.uniform(-0.8, 0.8, (90, 6)), 1.8 * np.eye(6)[[1]] + rng.normal(0.0, spread, (12, 6))])
    q += [0.3, -1.2, 1.3, 0.2, 1.0, 0.3]
    truth = arm.with_values(dict(zip(arm.default_free, hidden.tolist(), strict=True)))
    seen = truth.predict(q + off * far[:, None] * np.eye(6)[1])[:, :3, 3]
    rows = Dataset(q=q, position=seen + rng.normal(0.0, 3e-5, (102, 3)))
    assert len((found := identify(arm, rows, held_out=0.0)).outlying) == 12 * (abs(off) > 1e-3)
    assert ("nearer to the nominal" in found.refused(found.best).get("", "")) == (off * spread < -1e-6)


def test_a_session_that_is_far_off_as_a_whole_is_not_said_to_be_missing():
    """With a base that is known, all rows of another base were set apart: "no session B" was said."""
    second, rows = np.arange(70) >= 50, rows_of(1, count=70)
    moved = replace(wrong(rows, second, (0.5, 0.2, 0.1)), session=np.where(second, "B", "A"), rotation=None)
    with refuses(OptionError, option="held_out", found="B"):
        identify(load_robot("aria"), moved, held_out="session:B")

"""Tables and arms made in Python with one thing wrong: refused in one sentence, never used."""

import numpy as np
import pandas as pd
import pytest
from refusals import mentions, refuses

import workbench as wb
from workbench.base.errors import DataError, FileError, OptionError, ShapeError

ROWS = 40


def of_extra(name):
    """A verb of the root, unless its extra is not installed."""
    if name not in dir(wb):
        pytest.skip("of an extra that is not installed")
    return getattr(wb, name)


@pytest.fixture(scope="module")
def arm():
    return wb.load_robot("aria")


@pytest.fixture(scope="module")
def rows(arm):
    return wb.measure_poses(arm, ROWS, seed=1)[1]


@pytest.mark.parametrize("marks", [[0] * 39 + [1], [0.0] * 39 + [1.0], [False] * 39 + [True]])
def test_rows_are_kept_out_by_zeros_and_ones_too(arm, rows, marks):
    """Numbers were negated bit by bit and taken for indices: the error was that of the last two rows."""
    data = wb.Dataset(rows.q, rows.position, exclude=marks)
    assert wb.evaluate(arm, data).row_numbers.tolist() == list(range(39))


COLUMNS = {
    "exclude": [["no"] * ROWS, [2] * ROWS, 3],
    "rotation": [
        np.zeros((ROWS, 3, 3)),
        2.0 * np.eye(3)[None].repeat(ROWS, 0),
        -np.eye(3)[None].repeat(ROWS, 0),
    ],
    "sigma": [np.full((ROWS, 6), -1e-4), np.full((ROWS, 3), 1e-4), 1e-4],
    "distance": [np.zeros((ROWS, 1))],
    "time": [3.0, np.zeros((ROWS, 1)), ["noon"] * ROWS],
    "torque": [np.zeros((ROWS, 3))],
    "direction": [np.zeros((ROWS, 5))],
    "markers": [np.zeros((ROWS, 3))],
    "wrench": [np.zeros((ROWS, 3))],
    "payload": [np.zeros((ROWS, 2))],
    "session": ["a", ["a"] * 39],
    "group": [3],
    "row": [np.linspace(0.0, 1.0, ROWS), [3]],
    "position": [3, np.zeros((ROWS, 2)), np.zeros((39, 3))],
    "tilt": [np.zeros((ROWS, 2)), {1: np.zeros((39, 2))}, {1: np.zeros(ROWS)}],
    "more": [3],
    "readings": [3],
    "notes": [3],
    "source": [3],
    "q": [None, 3, np.zeros(6), [["a"] * 6], np.full((ROWS, 6), np.nan)],
}


@pytest.mark.parametrize(("name", "value"), [(n, v) for n, values in COLUMNS.items() for v in values])
def test_a_wrong_column_is_refused_where_the_table_is_made(rows, name, value):
    with pytest.raises((DataError, OptionError, ShapeError)) as refused:
        wb.Dataset(**{"q": rows.q, "position": rows.position, name: value})
    assert (
        mentions(str(refused.value), {"q": "joint", "rotation": "orientations"}.get(name, name))
        or name == "q"
    )


def test_a_row_without_joints_may_be_kept_out(arm, rows):
    q = rows.q.copy()
    q[7, 2] = np.nan
    with refuses(DataError, row=7, joint=2):
        wb.Dataset(q, rows.position)
    kept = wb.Dataset(q, rows.position, exclude=np.arange(ROWS) == 7)
    assert len(wb.evaluate(arm, kept).row_numbers) == ROWS - 1


@pytest.mark.parametrize("labels", [[None] * ROWS, [1] * ROWS, np.array(["a", None] * 20, object)])
def test_labels_are_texts(arm, rows, labels):
    data = wb.Dataset(rows.q, rows.position, rows.rotation, session=labels, group=labels)
    assert data.session.dtype.kind == "U"
    assert np.isfinite(wb.identify(arm, data, held_out=0.0).nominal.train.position_mm.mean)
    assert len(wb.split_sessions(data, 10).sessions) > 1


@pytest.mark.parametrize("chosen", [[True] * 39, [100], [0.0, 1.0], "a", [[0]], None])
def test_rows_that_are_not_there_can_not_be_taken(rows, chosen):
    with refuses(OptionError, option="rows"):
        rows.take(chosen)


def test_rows_are_taken_by_lists_of_all_kinds(rows):
    assert [len(rows.take(chosen)) for chosen in ((0, 1), [], np.array([]), [-1])] == [2, 0, 0, 1]


def test_only_tables_of_as_many_joints_are_joined(rows):
    with refuses(OptionError, option="other"):
        rows.joined(rows.to_frame())
    with refuses(ShapeError, expected=6, found=7):
        rows.joined(wb.measure_poses("iiwa7", 5)[1])


@pytest.mark.parametrize("verb", [wb.identify, wb.diagnose])
def test_fitted_rows_are_no_held_out_rows(arm, rows, verb):
    """Their errors were reported as held-out."""
    with refuses(DataError, row=0):
        verb(arm, rows, held_out=rows)
    found = verb(arm, rows.take(np.arange(30)), held_out=rows)
    assert len(found.held_out_data) == 10
    assert [note for note in found.notes if mentions(note, "30 held-out rows")]


@pytest.mark.parametrize("verb", ["identify", "diagnose", "rezero"])
def test_noise_of_joints_is_that_of_all_joints(arm, rows, verb):
    with refuses(ShapeError, expected=6, found=5):
        of_extra(verb)(arm, rows, noise=wb.Noise(joints=(1e-4,) * 5))


def test_a_constant_freed_twice_is_one(arm, rows):
    once, twice = (wb.identify(arm, rows, free=["joint1.theta"] * n) for n in (1, 2))
    assert len(twice.parameters()) == len(once.parameters())
    assert twice.error.after.position_mm.mean == once.error.after.position_mm.mean


@pytest.mark.parametrize(
    "values",
    [{"joint1.theta": np.nan}, {"joint1.theta": "90"}, {"base.x": "1mm"}, [("joint1.theta", 0.1)], None],
)
def test_values_of_constants_are_finite_numbers(arm, values):
    """NaN was written into files that nobody can read, and text without a unit was radians."""
    with refuses(OptionError):
        arm.with_values(values)


def test_arms_take_frames_of_their_kind(arm):
    with refuses(OptionError, option="base"):
        arm.with_frames(base=np.eye(4))
    with refuses(DataError):
        wb.Frame(rotation=np.zeros((3, 3)))
    assert wb.Frame.from_pose(np.eye(4).tolist()).pose.shape == (4, 4)
    with refuses(ShapeError):
        wb.Frame.from_pose(np.eye(3))
    with refuses(ShapeError):
        wb.Frame().moved([0.0] * 7)


@pytest.mark.parametrize("limits", [np.full((6, 2), np.nan), [[1.0, -1.0]] * 6])
def test_limits_have_a_lower_and_an_upper_end(arm, rows, limits):
    with refuses(DataError, joint=0):
        wb.solve(arm, arm.predict(rows.q[0]), limits=limits)


def test_numbers_that_are_none_are_refused(arm, rows):
    with refuses(DataError):
        wb.follow(arm, arm.predict(rows.q[0]), rows.q[0] * np.nan)
    for poses in (np.full((5, 6), np.nan), np.zeros((0, 6))):
        with refuses(OptionError, option="evaluation_poses"):
            wb.score(arm, "table2", evaluation_poses=poses)


@pytest.mark.parametrize(("name", "value"), [("length", -1.0), ("angle", -1.0), ("poses", 0), ("arms", 0)])
def test_trials_need_arms_poses_and_errors(arm, name, value):
    with refuses(OptionError, option=name):
        of_extra("try_plate")(arm, "table2", **{"arms": 10, "poses": 10, name: value})


@pytest.mark.parametrize("answer", [True, 3, None, "yes", [True]])
def test_a_wrong_answer_about_postures_costs_one_sentence(answer):
    """It was told in 25 lines of a compiler's."""
    robot, data = wb.load_robot("aria"), wb.measure_poses("aria", 30, seed=3, effects="joint-compliance:2")[1]
    found = wb.diagnose(robot, data, measurable=lambda q: answer)
    (warning,) = found.warnings
    assert mentions(warning, "measurable")
    assert len(warning) < 300


@pytest.mark.parametrize(
    ("write", "what", "name"),
    [
        (wb.write_toml, "aria", "arm.urdf"),
        (wb.write_urdf, "aria", "arm.toml"),
        (wb.write_plate, "table2", "plate.csv"),
    ],
)
def test_files_are_what_their_ending_says(tmp_path, write, what, name):
    with refuses(FileError, path=str(tmp_path / name)):
        write(what, tmp_path / name)
    assert not (tmp_path / name).exists()


def test_options_without_effect_are_refused(rows):
    with refuses(OptionError, option="tip"):
        wb.load_robot("aria", tip="flange")
    for option in ("layout", "sheet"):
        with refuses(OptionError, option=option):
            wb.read_measurements(rows.to_frame(), **{option: "x"})


def test_texts_that_are_no_paths(rows):
    for read, text in (
        (wb.read_measurements, rows.to_frame().to_csv()),
        (wb.load_robot, "a" * 300 + ".toml"),
        (wb.load_plate, "a" * 300 + ".toml"),
    ):
        with refuses(FileError):
            read(text)
    with refuses(FileError):
        wb.write_toml("aria", "a\0b.toml")


def test_a_column_that_a_frame_has_twice_is_named(arm, rows):
    frame = rows.to_frame().rename(columns={"q2[rad]": "q1[rad]"})
    with refuses(DataError, "q1[rad]", column="q1[rad]"):
        wb.identify(arm, frame)
    with pytest.raises(wb.WorkbenchError):
        wb.identify(arm, pd.DataFrame())


def test_extraction_is_of_the_arm_that_was_read(rows):
    with refuses(ShapeError, expected=7, found=6):
        of_extra("extract")("iiwa7", rows)

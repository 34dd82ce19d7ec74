"""What a notebook calls at the root, and how the answers look."""

import threading

import numpy as np
import pytest

import workbench as wb
from workbench.base import threads
from workbench.base.errors import OptionError, ShapeError
from workbench.data.readers.trajectory import Trajectory

TABLE = [
    [0.0, 0.1, 0.0, np.pi / 2],
    [0.0, 0.0, 0.5, 0.0],
    [0.0, 0.0, 0.4, 0.0],
    [0.0, 0.1, 0.0, np.pi / 2],
    [0.0, 0.1, 0.0, -np.pi / 2],
    [0.0, 0.1, 0.0, 0.0],
]
LIMITS = [[-3.0, 3.0]] * 6


@pytest.fixture(scope="module")
def rows():
    """40 poses of a virtual ARIA."""
    return wb.measure_poses(wb.load_robot("aria"), 40, seed=1)[1]


@pytest.fixture(scope="module")
def fit(rows):
    """ARIA, identified from them."""
    return wb.identify(wb.load_robot("aria"), rows)


@pytest.fixture
def unchecked(request):
    """Skips where arguments are checked against their annotations, which name arrays and no lists."""
    if request.config.getoption("--jaxtyping-packages", None):
        pytest.skip("annotations are checked in this run")


# -- results --------------------------------------------------------------------------------------


@pytest.mark.extra("trajectories")
def test_a_plate_and_a_corrected_path_print_in_a_few_lines(fit):
    text = "targets made exactly, no play in the seats"
    assert repr(wb.load_plate("table2")) == f"<Plate Table 2: 10 targets; {text}>"
    q = np.linspace(np.full(6, 0.2), np.full(6, 0.3), 20)
    path = Trajectory(time=None, q=q, position=None, rotation=None, source="table", notes=())
    found = str(wb.compensate(fit.robot, path, nominal=fit.nominal_robot))
    assert "as commanded" in found
    assert len(found) < 2000


def test_an_evaluation_prints_and_is_drawn(fit, rows):
    found = wb.evaluate(fit.robot, rows)
    assert "40" in str(found)
    assert found.plot()._repr_png_().startswith(b"\x89PNG")


def test_markup_in_a_name_is_only_text(rows):
    from dataclasses import replace

    found = wb.evaluate(replace(wb.load_robot("aria"), name="<b>[red]x"), rows)
    assert "&lt;b&gt;[red]x" in found._repr_html_()
    assert "<b>[red]x" in str(found)


# -- robots ---------------------------------------------------------------------------------------


def test_an_arm_from_a_table_is_the_arm_of_a_file(tmp_path):
    arm = wb.Robot.from_dh(TABLE, name="mine", limits=LIMITS)
    again = wb.load_robot(arm.save(tmp_path / "arm.toml"))
    q = np.array([[0.1, -0.5, 0.8, 0.3, 0.2, -1.0]])
    np.testing.assert_allclose(wb.tool_poses(again, q), wb.tool_poses(arm, q), atol=1e-15)
    urdf = wb.Robot.from_urdf(arm.save(tmp_path / "arm.urdf"))
    np.testing.assert_allclose(wb.tool_poses(urdf, q), wb.tool_poses(arm, q), atol=1e-12)
    assert arm.limits.tolist() == LIMITS
    assert repr(arm) == "<Robot mine: 6 joints, dh, 24 constants to identify>"


# -- measurements ---------------------------------------------------------------------------------


def test_arrays_make_a_dataset_that_numbers_its_rows(rows, fit):
    data = wb.Dataset(rows.q, rows.position, rows.rotation)
    assert data.row.tolist() == list(range(40))
    assert data.take(np.array([3, 5])).row.tolist() == [3, 5]
    found = wb.identify(wb.load_robot("aria"), data)
    assert found.error.after.position_mm.mean == pytest.approx(fit.error.after.position_mm.mean, rel=0.1)
    assert repr(data) == "<Dataset data: 40 rows of 6 joints; position, rotation>"


@pytest.mark.usefixtures("unchecked")
def test_lists_and_whole_numbers_are_welcome(rows):
    data = wb.Dataset(rows.q.tolist(), rows.position.tolist(), rows.rotation.tolist(), time=[*range(40)])
    assert data.time.dtype == float
    np.testing.assert_array_equal(data.q, rows.q)
    for values, error in (
        (([1, 2, 3],), OptionError),
        (([[1, 2]], [[1, 2]]), OptionError),
        (([[1, "a"]],), OptionError),
        (([[1, 2], [2, 3]], [[1, 2, 3]]), ShapeError),
    ):
        with pytest.raises(error):
            wb.Dataset(*values)


def frame_of(path) -> dict[str, list]:
    """A written file's columns."""
    head, *lines = [line.split(",") for line in path.read_text().splitlines() if not line.startswith("#")]
    return {
        name: [float(cell) for cell in column]
        for name, column in zip(head, zip(*lines, strict=True), strict=True)
    }


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_a_frame_is_read_by_its_columns_with_units(library, rows, tmp_path):
    path = wb.write_measurements(rows, tmp_path / "rows.csv")
    columns = frame_of(path)
    frame = pytest.importorskip(library).DataFrame(columns)
    read, wanted = wb.read_measurements(frame), wb.read_measurements(path)
    np.testing.assert_array_equal(read.q, wanted.q)
    np.testing.assert_array_equal(read.position, wanted.position)
    np.testing.assert_array_equal(read.rotation, wanted.rotation)
    assert len(read) == 40


# -- threads --------------------------------------------------------------------------------------


@pytest.fixture
def own_limit(monkeypatch):
    """A limit beside that of the process, which a page that is open in other tests may hold."""
    monkeypatch.setattr(threads, "_LIMIT", threads._Limit())


def test_the_limit_holds_in_every_thread_whichever_was_first(own_limit):
    control = pytest.importorskip("threadpoolctl")

    def pools() -> set[int]:
        return {pool["num_threads"] for pool in control.threadpool_info() if pool["user_api"] == "blas"}

    @threads.one_thread()
    def work() -> None:
        seen.append(pools())

    seen: list[set[int]] = []
    with control.threadpool_limits(2, user_api="blas"):
        work()
        before = pools()
        other = threading.Thread(target=work)
        other.start()
        other.join()
        assert seen == [{1}, {1}]
        assert pools() == before

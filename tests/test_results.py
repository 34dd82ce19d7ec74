"""What a notebook calls at the root, and how the answers look."""

import threading

import numpy as np
import pytest

import workbench as wb
from workbench.base import threads


@pytest.fixture(scope="module")
def rows():
    """40 poses of a virtual ARIA."""
    return wb.measure_poses(wb.load_robot("aria"), 40, seed=1)[1]


@pytest.fixture(scope="module")
def fit(rows):
    """ARIA, identified from them."""
    return wb.identify(wb.load_robot("aria"), rows)


# -- results --------------------------------------------------------------------------------------


def test_an_evaluation_prints_and_is_drawn(fit, rows):
    found = wb.evaluate(fit.robot, rows)
    assert "40" in str(found)
    assert found._repr_html_().count("<circle") == 40


# -- measurements ---------------------------------------------------------------------------------


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_a_frame_is_read_by_its_columns_with_units(library, rows, tmp_path):
    path = wb.write_measurements(rows, tmp_path / "rows.csv")
    frame = pytest.importorskip(library).read_csv(path)
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

"""Progress and cancel of long work, and its pieces in other threads, in their order."""

import threading

import pytest

from workbench.base.progress import Cancelled, cancelled, check_cancelled, part_of, progress, running
from workbench.base.threads import in_order


def test_parts_of_the_work_are_scaled_and_may_have_a_text_of_their_own():
    seen = []
    with running(lambda share, text: seen.append((share, text))):
        progress(0.1, "first")
        with part_of(0.2, 0.6), part_of(0.5, 0.5):
            progress(0.5, "inner")
        with part_of(0.8, 0.2, "outer"):
            progress(1.0, "inner")
        progress(1.0, "done")
    progress(0.0, "nobody listens")
    assert seen == [(0.1, "first"), (pytest.approx(0.65), "inner"), (1.0, "outer"), (1.0, "done")]


def test_work_is_stopped_within_and_nowhere_else():
    check_cancelled()
    with running(cancel=lambda: True):
        with part_of(0.0, 0.5), pytest.raises(Cancelled):
            check_cancelled()
        with running():
            assert not cancelled()
        found = []
        other = threading.Thread(target=lambda: found.append(cancelled()))
        other.start()
        other.join()
        assert found == [False]
    assert not cancelled()


def test_pieces_come_in_their_order_and_the_next_are_made_meanwhile():
    both = threading.Barrier(2, timeout=60)  # nobody passes unless two are under way at once
    square = lambda piece: (both.wait(), piece**2)[1]  # noqa: E731
    assert list(in_order(square, range(4))) == [0, 1, 4, 9]
    assert list(in_order(lambda _: threading.current_thread(), [0])) == [threading.current_thread()]


def test_a_piece_that_fails_fails_where_it_is_used():
    results = in_order(lambda piece: 1 // piece, [1, 0, 1])
    assert next(results) == 1
    with pytest.raises(ZeroDivisionError):
        next(results)

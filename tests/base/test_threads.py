"""Pieces of large work in other threads, in their order."""

import threading

import pytest

from workbench.base.threads import in_order


def test_pieces_come_in_their_order_and_the_next_are_made_meanwhile():
    both = threading.Barrier(2, timeout=60)  # nobody passes unless two are under way at once

    def square(piece: int) -> int:
        both.wait()
        return piece**2

    assert list(in_order(square, range(4))) == [0, 1, 4, 9]
    assert list(in_order(lambda _: threading.current_thread(), [0])) == [threading.current_thread()]


def test_a_piece_that_fails_fails_where_it_is_used():
    results = in_order(lambda piece: 1 // piece, [1, 0, 1])
    assert next(results) == 1
    with pytest.raises(ZeroDivisionError):
        next(results)

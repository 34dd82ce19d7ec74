import threading

import pytest

from workbench.base.progress import Cancelled, cancelled, check_cancelled, part_of, progress, running


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
    def look(found):
        found.append(cancelled())

    check_cancelled()
    with running(cancel=lambda: True):
        with part_of(0.0, 0.5), pytest.raises(Cancelled):
            check_cancelled()
        with running():
            assert not cancelled()
        found = []
        other = threading.Thread(target=look, args=(found,))
        other.start()
        other.join()
        assert found == [False]
    assert not cancelled()

"""The works done again once for all tests that look at what came out."""

import pytest

KATANA = {"arms": 8, "weighed": 12, "diagnosed": 1, "seed": 0}
"""Of eight arms: nine in ten of only three is an interval that any change of a pose moves by a tenth."""
ARIA = {"arms": 1, "seed": 0}


@pytest.fixture(scope="session")
def katana():
    from studies.katana import reproduce_katana

    return reproduce_katana(**KATANA)


@pytest.fixture(scope="session")
def reproduced_aria():
    from studies.aria import reproduce_aria

    return reproduce_aria(**ARIA)


@pytest.fixture
def reproduce(run, monkeypatch):
    """Run `workbench reproduce` with options whose study has been done: its output is of what was found."""

    def call(work, options, found, *words):
        def known(**asked):
            assert asked == options
            return found

        monkeypatch.setattr(f"studies.{work}.reproduce_{work}", known)
        given = (word for name, value in options.items() for word in (f"--{name}", str(value)))
        status, out, _ = run("reproduce", work, *given, *words)
        assert status == 0
        return out

    return call

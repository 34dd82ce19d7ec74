"""Cases of a test that take long, beside those that run at every time."""

import pytest


def slow(*case):
    return pytest.param(*case, marks=pytest.mark.slow)

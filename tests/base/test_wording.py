import pytest

from workbench.base.wording import in_mm


@pytest.mark.parametrize(
    ("metres", "words"),
    [
        (0.0, "less than 0.001 mm"),
        (1.7e-6, "0.0017 mm"),
        (1.2345e-4, "0.123 mm"),
        (-2.5e-3, "-2.5 mm"),
        (0.01234, "12.3 mm"),
        (0.3456, "346 mm"),
    ],
)
def test_lengths_in_words(metres, words):
    assert in_mm(metres) == words

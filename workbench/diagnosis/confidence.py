"""Confidence in a cause: odds and their names.

What else a cause must pass to be certain is decided in `claimed_causes.py`.
"""

from enum import StrEnum

CERTAIN, PROBABLE = 1000.0, 20.0
"""Minimum odds for each name; below, cause and rival can't be distinguished."""


class Confidence(StrEnum):
    """Confidence in a cause, by its odds."""

    CERTAIN = "certain"
    PROBABLE = "probable"
    OPEN = "cannot tell"

    @classmethod
    def of(cls, odds: float) -> "Confidence":
        return cls.CERTAIN if odds >= CERTAIN else cls.PROBABLE if odds >= PROBABLE else cls.OPEN

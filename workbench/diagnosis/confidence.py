"""How sure a cause is: odds, and the names that they have."""

from enum import StrEnum

CERTAIN, PROBABLE = 1000.0, 20.0
"""Odds from which on a cause is called so; below, it can't be told from its rival."""


class Confidence(StrEnum):
    """How sure a cause is, by its odds."""

    CERTAIN = "certain"
    PROBABLE = "probable"
    OPEN = "cannot tell"

    @classmethod
    def of(cls, odds: float) -> "Confidence":
        return cls.CERTAIN if odds >= CERTAIN else cls.PROBABLE if odds >= PROBABLE else cls.OPEN

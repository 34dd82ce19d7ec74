"""Confidence in a cause: odds and their names; what else certain ones must pass is in `claimed_causes.py`."""

from enum import StrEnum

CERTAIN, PROBABLE = 1000.0, 20.0
"""Minimum odds for each name against claims and processes elsewhere; below, a cause and its rival are one."""
CERTAIN_LAW = 100.0
"""Minimum odds of a certain law against processes, which are freer: that alone costs them 100 and more."""
MAX_ODDS = 1e12
"""Odds are capped at this value."""


class Confidence(StrEnum):
    """Confidence in a cause, by its odds."""

    CERTAIN = "certain"
    PROBABLE = "probable"
    OPEN = "cannot tell"

    @classmethod
    def of(cls, odds: float) -> "Confidence":
        return cls.CERTAIN if odds >= CERTAIN else cls.PROBABLE if odds >= PROBABLE else cls.OPEN

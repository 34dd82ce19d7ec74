"""What a diagnosis claims, by the names of its causes.

An effect of several joints or orders is several names. A claim that `cannot tell` leads a class of
look-alikes: it names nothing, and is no accusation either if the truth is in its class.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from cases import Named

UNDECIDED = "cannot tell"


@dataclass(frozen=True)
class Claim:
    """One cause that a diagnosis names.

    Args:
        names: What it says is there, one entry a joint and order.
        rivals: What it says may be there instead.
        confidence: `certain`, `probable` or `cannot tell`; empty where the diagnosis states none.
        odds: Posterior odds against the best rival of another kind; NaN where none are stated.
        sentence: As people read it.
    """

    names: tuple[Named, ...]
    rivals: tuple[Named, ...] = ()
    confidence: str = ""
    odds: float = float("nan")
    sentence: str = ""

    @property
    def decided(self) -> bool:
        """Whether it names one thing."""
        return self.confidence != UNDECIDED

    @property
    def probability(self) -> float:
        """What it says of itself, from its odds."""
        return 1.0 if np.isposinf(self.odds) else self.odds / (1.0 + self.odds)


def claims(result) -> tuple[Claim, ...]:
    """Causes of a diagnosis."""
    return tuple(
        Claim(
            names=tuple(named(cause.whole)),
            rivals=tuple(n for other in cause.look_alikes for n in named(other)),
            confidence=str(cause.confidence),
            odds=float(cause.odds),
            sentence=cause.sentence,
        )
        for cause in result.causes
    )


def named(effect) -> Iterator[Named]:
    """Names of an effect or event, one a joint and order."""
    whole = effect.name == "joint-coupling" or not effect.joints
    details = getattr(effect, "orders", (getattr(effect, "by", None),))
    for joints in [effect.joints] if whole else [(j,) for j in effect.joints]:
        yield from (Named(effect.name, joints, detail) for detail in details)


def map_gain(result) -> float:
    """What the residual map takes off the mean held-out error [mm]; NaN where there is none."""
    found = getattr(result, "residual_map", None)
    return (
        float("nan") if found is None else float(found.before.position_mm.mean - found.after.position_mm.mean)
    )

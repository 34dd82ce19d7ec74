"""The instrument: how well it measures."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.session.command import AbstractChange
from workbench.session.state import Noise, Session
from workbench.session.target_steps import judged_anew

LARGEST_POSITION, LARGEST_ROTATION = 0.1, float(np.deg2rad(10.0))


@dataclass(frozen=True)
class SetNoise(AbstractChange):
    """Say how well the instrument measures; the predicted errors follow.

    Args:
        position: Standard deviation of a coordinate [m].
        rotation: Standard deviation of a rotation about an axis [rad].
    """

    position: float
    rotation: float

    @property
    def title(self) -> str:
        return "Set the instrument's noise"

    @property
    def key(self) -> Hashable | None:
        return "noise"

    def check(self, session: Session) -> None:
        for what, value, largest in (
            ("position", self.position, LARGEST_POSITION),
            ("rotation", self.rotation, LARGEST_ROTATION),
        ):
            if not 0.0 < value <= largest:
                raise OptionError(
                    f"the instrument's {what} noise is {value:g}; give one above 0, up to {largest:.3g}"
                )

    def apply(self, session: Session) -> Session:
        noise = Noise(self.position, self.rotation)
        return judged_anew(replace(session, noise=noise))

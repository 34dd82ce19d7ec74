"""Thermal growth: all lengths of the arm and the tool grow with temperature.

    Δv = c (T − T_ref) ℓ,      ℓ the length of the element (with its drive), c [1/K]

A constant origin, as in a URDF joint, grows through the three corrections that follow it. The base is
excluded, as it is fixed to the floor.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.chain import Axis, Chain
from workbench.arm.effects.axes import Wrenches
from workbench.arm.effects.effect import AbstractEffect, Growth, Law
from workbench.arm.frame import BASE
from workbench.arm.motion import Motion


@final
@dataclass(frozen=True)
class ThermalGrowth(AbstractEffect):
    """One coefficient for the whole arm.

    Args:
        reference: Temperature T_ref at which lengths have their stated values [degC].
    """

    reference: float = 20.0
    name = "thermal-growth"
    does = "the arm grows with the temperature", "the arm grows with the temperature"
    needs = ("temperature",)
    whole_arm = True
    unit = ("1/K", "1/K")
    typical_size = 2.3e-5  # aluminium [1/K]
    largest = 1.5e-4
    """[1/K] Steel grows by 1.2e-5, aluminium by 2.3e-5, printed plastics by up to 1e-4."""

    def elements(self, chain: Chain) -> tuple[str, ...]:
        return tuple(chain.elements[k].name for k in _lengths(chain))

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        places = _lengths(chain)
        lengths = np.tile(chain.values[places] + _of_constants(chain)[places], (len(motion), 1))
        positions = chain.positions(motion.q)
        for column, k in enumerate(places):
            if chain.drivers[k] >= 0:
                lengths[:, column] += positions[:, chain.drivers[k]]
        return (lengths * self._warmer(motion)[:, None])[..., None]

    def growth(
        self, chain: Chain, motion: Motion, wrenches: Wrenches, constants: Int[np.ndarray, " p"]
    ) -> Growth:
        same = np.array(_lengths(chain))[:, None] == constants
        return self.coefficients[0] * self._warmer(motion)[:, None, None] * same

    def _warmer(self, motion: Motion) -> Float[np.ndarray, " rows"]:
        return motion.need("temperature", self.name) - self.reference


def _lengths(chain: Chain) -> list[int]:
    """Translations of arm and tool."""
    return [
        k
        for k, e in enumerate(chain.elements)
        if Axis.TX <= e.axis <= Axis.TZ and (e.link != BASE or e.joint is not None)
    ]


def _of_constants(chain: Chain) -> np.ndarray:
    """Lengths of constant origins, as increments of the three translations after each, in their axes."""
    out = np.zeros(len(chain.elements))
    for k, e in enumerate(chain.elements[:-3]):
        if e.matrix is not None and e.link != BASE:
            following = [x.axis for x in chain.elements[k + 1 : k + 4]]
            if following == [Axis.TX, Axis.TY, Axis.TZ]:
                out[k + 1 : k + 4] = e.matrix[:3, :3].T @ e.matrix[:3, 3]
    return out

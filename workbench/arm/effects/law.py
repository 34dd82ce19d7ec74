"""What laws of effects are made of: the loads that drive them, and the shapes of their arrays.

    v_k = driver_k(q) + p_k + Σ_e c_e · φ_e,k(state)

Wrenches are those of `arm/statics/wrenches.py`: they hold the later link against its load. A joint deflects
with the load, so that load effects have a minus sign: a positive compliance sags.
"""

from enum import IntEnum

import numpy as np
from jaxtyping import Float

from workbench.arm.effects.axes import Wrenches

__all__ = ["NO_COMPONENTS", "NO_WRENCHES", "Growth", "Law", "Loads", "Slope", "Wrenches"]

Law = Float[np.ndarray, "rows e c"]
Slope = Float[np.ndarray, "rows e m"]
Growth = Float[np.ndarray, "rows e p"]
NO_WRENCHES = np.zeros((0, 0, 6))
NO_WRENCHES.setflags(write=False)
NO_COMPONENTS = np.zeros((0, 2), np.int64)
NO_COMPONENTS.setflags(write=False)


class Loads(IntEnum):
    """Which wrenches through the joints an effect depends on."""

    NONE = 0
    OWN = 1
    ALL = 2

"""Array aliases with their shapes, and the enumerations that several wings share.

Shapes are read by jaxtyping; the tests check them at run time with beartype.
"""

from enum import StrEnum

import numpy as np
from jaxtyping import Float

Vector3 = Float[np.ndarray, "3"]
Matrix3 = Float[np.ndarray, "3 3"]
Matrix4 = Float[np.ndarray, "4 4"]
Poses = Float[np.ndarray, "rows 4 4"]
Positions = Float[np.ndarray, "rows 3"]
Rotations = Float[np.ndarray, "rows 3 3"]
JointRows = Float[np.ndarray, "rows n"]


def frozen(array: np.ndarray) -> np.ndarray:
    """A contiguous, read-only view, fit to stand in a frozen record; the caller's array stays as it is."""
    view = np.ascontiguousarray(array).view()
    view.setflags(write=False)
    return view


class Outcome(StrEnum):
    """How a computation ended. Not converging is a result that is shown, not an exception."""

    CONVERGED = "converged"
    STALLED = "stalled: no step reduces the error any further, and the gradient is not zero"
    ITERATION_LIMIT = "stopped at the iteration limit"
    CANCELLED = "cancelled"
    DIVERGED = "diverged: the error is no longer a finite number"

    @property
    def ok(self) -> bool:
        """Whether the result can be used as an optimum."""
        return self is Outcome.CONVERGED


class Freedom(StrEnum):
    """Whether a base or tool frame is known, unknown, or left to the data."""

    FIXED = "fixed"
    FREE = "free"
    AUTO = "auto"

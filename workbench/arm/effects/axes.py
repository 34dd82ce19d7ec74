"""A joint's axis in a chain: moments about and across it, and rotations inserted next to it."""

from collections.abc import Iterable, Sequence
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.chain import Axis, Chain, Element
from workbench.arm.frame import FRAME_PARTS

Wrenches = Float[np.ndarray, "_ _ 6"]
PART_UNITS = ("m",) * 3 + ("rad",) * 3
"""Units of `FRAME_PARTS`."""


class Insertion(IntEnum):
    """Rotations that an effect needs and the geometry lacks.

    Two across a joint's axis, right before (tilt) or after (bend) its driven element; or three after the
    base's own (drift) or the tool's own (slip).
    """

    NONE = 0
    TILT = 1
    BEND = 2
    DRIFT = 3
    SLIP = 4

    @property
    def of_joint(self) -> bool:
        """Whether it is next to a joint, rather than after base or tool."""
        return self in (Insertion.TILT, Insertion.BEND)

    def element(self, joint: int, axis: int) -> str:
        """Name of a joint's inserted tilt or bend rotation about one axis."""
        return f"joint{joint + 1}.{self.name.lower()}_{'xyz'[axis]}"

    @property
    def frame(self) -> tuple[str, ...]:
        """Elements of a drifting base or a slipping tool: its own translations, the inserted rotations."""
        owner, own = "base" if self is Insertion.DRIFT else "tool", self.name.lower()
        return (*(f"{owner}.{p}" for p in FRAME_PARTS[:3]), *(f"{owner}.{own}_{p}" for p in FRAME_PARTS[3:]))


def driven(chain: Chain, joint: int) -> Element:
    """The (first) element driven by a joint."""
    return chain.elements[chain.driven[joint]]


def driven_names(chain: Chain, joints: Iterable[int]) -> tuple[str, ...]:
    return tuple(driven(chain, j).name for j in joints)


def turns(chain: Chain, joint: int) -> bool:
    """Whether a joint is revolute; True for a joint that the arm lacks, which `check` refuses."""
    return not 0 <= joint < chain.dof or Axis(driven(chain, joint).axis).turns


def own_components(chain: Chain, joints: Iterable[int]) -> Int[np.ndarray, "j 2"]:
    """Joint and component of [f; τ] of the moment about (force along) each joint's own axis."""
    return np.array([[j, (driven(chain, j).axis + 3) % 6] for j in joints], np.int64).reshape(-1, 2)


def own(chain: Chain, joints: Sequence[int], wrenches: Wrenches) -> Float[np.ndarray, "rows j"]:
    """Moment about (force along) each joint's own axis [N m or N]."""
    return wrenches[:, *own_components(chain, joints).T]


def across_axes(chain: Chain, joint: int) -> tuple[int, int]:
    """The two axes across a joint's own, in cyclic order: y, z for x; z, x for y; x, y for z."""
    axis = driven(chain, joint).axis % 3
    return (axis + 1) % 3, (axis + 2) % 3


def across_components(chain: Chain, joints: Iterable[int]) -> Int[np.ndarray, "j2 2"]:
    """Joint and component of [f; τ] of the two moments across each joint's axis."""
    found = [[j, 3 + axis] for j in joints for axis in across_axes(chain, j)]
    return np.array(found, np.int64).reshape(-1, 2)


def across(chain: Chain, joints: Sequence[int], wrenches: Wrenches) -> Float[np.ndarray, "rows j 2"]:
    """Moments across each joint's axis [N m]."""
    return wrenches[:, *across_components(chain, joints).T].reshape(len(wrenches), len(joints), 2)


def inserted_names(chain: Chain, joints: Iterable[int], kind: Insertion) -> tuple[str, ...]:
    """Names of the inserted rotations of some joints, two each."""
    return tuple(kind.element(j, axis) for j in joints for axis in across_axes(chain, j))


def diagonal(columns: Float[np.ndarray, "rows j"]) -> Float[np.ndarray, "rows j j"]:
    """A law in which every coefficient changes one element."""
    return columns[:, :, None] * np.eye(columns.shape[1])


def paired(columns: Float[np.ndarray, "rows j 2"]) -> Float[np.ndarray, "rows e j"]:
    """A law in which every coefficient changes two elements."""
    rows, joints, _ = columns.shape
    return (columns[..., None] * np.eye(joints)[:, None]).reshape(rows, 2 * joints, joints)


def blocks(pairs: Float[np.ndarray, "rows j 2 2"]) -> Float[np.ndarray, "rows e e"]:
    """Matrices with a block of two rows and columns for every joint."""
    rows, joints = pairs.shape[:2]
    return (pairs[:, :, :, None] * np.eye(joints)[:, None, :, None]).reshape(rows, 2 * joints, 2 * joints)

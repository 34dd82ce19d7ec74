"""Targets to be measured in sequence, and the sample stored for each.

A `CaptureProgress` is plain data: storing a row gives a new one. A row that was taken badly is taken again.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.data.dataset import Dataset
from workbench.extras.live.sample import Sample


@dataclass(frozen=True, eq=False, kw_only=True)
class CaptureTarget:
    """A pose to be measured.

    Args:
        name: Name of the target.
        pose: Pose of the tool, in the frame that the source measures in; None: any pose will do.
        q: Joint positions [rad or m]; None: any.
    """

    name: str
    pose: Float[np.ndarray, "4 4"] | None = None
    q: Float[np.ndarray, " n"] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class CaptureProgress:
    """Targets in their order, and what has been stored for each.

    Args:
        targets: Targets in the order in which they are taken.
        taken: Stored sample of each target; None: still to be taken.
        current: Index of the target that the next stored sample belongs to.
        session: Name of the placement of robot and instrument.
    """

    targets: tuple[CaptureTarget, ...]
    taken: tuple[Sample | None, ...] = field(default=())
    current: int = 0
    session: str = ""

    def __post_init__(self):
        if not self.targets:
            raise OptionError("a capture needs at least one target")
        if not self.taken:
            object.__setattr__(self, "taken", (None,) * len(self.targets))
        if len(self.taken) != len(self.targets):
            raise ShapeError(
                f"there are {len(self.taken)} stored samples for {len(self.targets)} targets",
                expected=len(self.targets),
                found=len(self.taken),
            )

    @property
    def done(self) -> bool:
        """Whether every target has been taken."""
        return all(sample is not None for sample in self.taken)

    @property
    def remaining(self) -> int:
        """Number of targets still to be taken."""
        return sum(sample is None for sample in self.taken)

    @property
    def target(self) -> CaptureTarget:
        """The target that comes next."""
        return self.targets[self.current]

    def store(self, sample: Sample) -> "CaptureProgress":
        """The capture with the sample stored for the current target, and the next open one made current."""
        if sample.position is None:
            raise DataError("this sample has no measured position: wait until the instrument sees the tool")
        joints = next((len(other.q) for other in self.taken if other is not None), len(sample.q))
        if len(sample.q) != joints:
            raise ShapeError(
                f"the sample has {len(sample.q)} joints, earlier ones have {joints}",
                expected=joints,
                found=len(sample.q),
            )
        taken = (*self.taken[: self.current], sample, *self.taken[self.current + 1 :])
        return replace(self, taken=taken, current=_next_open(taken, self.current))

    def again(self, index: int) -> "CaptureProgress":
        """The capture with one target open again, to be taken next."""
        self._check(index)
        return replace(self, taken=(*self.taken[:index], None, *self.taken[index + 1 :]), current=index)

    def go_to(self, index: int) -> "CaptureProgress":
        """The capture with another target made current; its row stays until it is stored anew."""
        self._check(index)
        return replace(self, current=index)

    def dataset(self, *, source: str = "live capture") -> Dataset:
        """What has been stored, in the order of the targets; a target's name is its group."""
        rows = [i for i, sample in enumerate(self.taken) if sample is not None]
        kept = [sample for sample in self.taken if sample is not None]
        if not kept:
            raise DataError(f"{source}: nothing has been stored yet")
        seen = [sample.rotation for sample in kept if sample.rotation is not None]
        partly = 0 < len(seen) < len(kept)
        left = self.remaining
        notes: tuple[str, ...] = (
            (f"{len(kept)} of {len(self.targets)} targets were measured",) if left else ()
        )
        notes += ("orientations are left out, as some rows have none",) if partly else ()
        return Dataset(
            q=np.stack([sample.q for sample in kept]),
            row=np.array(rows),
            position=np.stack([sample.position for sample in kept if sample.position is not None]),
            rotation=np.stack(seen) if len(seen) == len(kept) else None,
            time=np.array([sample.time for sample in kept]),
            group=np.array([self.targets[i].name for i in rows], dtype=str),
            session=np.full(len(kept), self.session) if self.session else None,
            source=source,
            notes=notes,
        )

    def _check(self, index: int) -> None:
        if not 0 <= index < len(self.targets):
            raise OptionError(f"target must be 1–{len(self.targets)}, got {index + 1}")


def _next_open(taken: tuple[Sample | None, ...], current: int) -> int:
    """The first open target after the current one, else the first open one, else the current one."""
    order = [*range(current + 1, len(taken)), *range(current)]
    return next((i for i in order if taken[i] is None), current)

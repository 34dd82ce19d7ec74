"""State of a robot in each row: everything that laws of effects may depend on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from workbench.base.array_checks import numbers
from workbench.base.columns import COLUMNS
from workbench.base.errors import DataError, ShapeError
from workbench.base.types import frozen

PER_JOINT = frozenset({"direction", "torque", "velocity", "acceleration", "flank"})
"""Drivers with a number for each joint in a row."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Joint positions and other known quantities of each row; None if unknown.

    Args:
        q: Joint positions [rad or m].
        direction: Sign of each joint's last motion (-1, 0, +1).
        payload: Mass at the tool [kg]; none if None.
        torque: Measured joint torques [N m].
        wrench: External [f; τ] at the tool's origin, in the axes of the robot's gravity [N, N m]; none if
            None.
        velocity: Joint velocities [rad/s or m/s]; at rest if None.
        acceleration: Joint accelerations [rad/s² or m/s²]; none if None.
        row: Number of each row in its file; None for poses outside any file, or after its measurements.
        flank: Sign of the flank on which each joint rests in its backlash, if fixed by a fit; NaN if the load
            decides.
        more: Drivers of other packages, by the name of their column.
    """

    q: Float[np.ndarray, "rows n"]
    direction: Float[np.ndarray, "_ _"] | None = None
    time: Float[np.ndarray, " _"] | None = None
    temperature: Float[np.ndarray, " _"] | None = None
    payload: Float[np.ndarray, " _"] | None = None
    torque: Float[np.ndarray, "_ _"] | None = None
    wrench: Float[np.ndarray, "_ 6"] | None = None
    velocity: Float[np.ndarray, "_ _"] | None = None
    acceleration: Float[np.ndarray, "_ _"] | None = None
    row: Int[np.ndarray, " _"] | None = None
    flank: Float[np.ndarray, "_ _"] | None = None
    more: Mapping[str, Float[np.ndarray, "_ ..."]] = field(default_factory=dict)

    def __post_init__(self):
        for name in ("q", *_OWN):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, self._checked(name, value))
        if self.more:
            if not isinstance(self.more, Mapping):
                raise DataError(f"more must be a mapping from columns to their rows, got {self.more!r}")
            checked = {name: self._checked(name, values) for name, values in self.more.items()}
            object.__setattr__(self, "more", checked)

    def _checked(self, name: str, value: np.ndarray) -> np.ndarray:
        """A driver with as many rows as there are joint positions."""
        if not isinstance(value, np.ndarray):
            value = numbers(value, name)
        if not value.ndim:
            raise DataError(f"'{name}' must have a row for each pose, got a single number")
        if len(value) != len(self.q):
            text = f"'{name}' has {len(value)} rows, the joint positions {len(self.q)}; give one for each"
            raise ShapeError(text, expected=len(self.q), found=len(value))
        of_rows = {"wrench": (6,)}.get(name, self.q.shape[1:] if name in PER_JOINT else ())
        if name in _OWN and value.shape[1:] != of_rows:
            expected, found = int(np.prod(of_rows)), int(np.prod(value.shape[1:]))
            text = f"'{name}' has {found} numbers in each row, it must have {expected}"
            raise ShapeError(text, expected=expected, found=found)
        return frozen(value)

    def __len__(self) -> int:
        return len(self.q)

    @classmethod
    def of(cls, data: Any) -> "Motion":
        """The drivers of a table of measurements: its attributes of these names, if present."""
        own: dict[str, Any] = {name: getattr(data, name, None) for name in _OWN}
        if getattr(data, "is_of_later", False):
            own["row"] = None
        more = getattr(data, "more", {})
        return cls(data.q, **own, more={n: v for n, v in more.items() if n in COLUMNS and COLUMNS[n].driver})

    @classmethod
    def joined(cls, parts: Sequence["Motion"]) -> "Motion":
        """Rows of several tables, one after the other; a driver missing in one of them is dropped."""
        shared = set.intersection(*(set(part.drivers) for part in parts))
        drivers = {n: np.concatenate([part.drivers[n] for part in parts]) for n in shared}
        return cls.with_drivers(np.concatenate([part.q for part in parts]), drivers)

    @classmethod
    def with_drivers(cls, q: np.ndarray, drivers: Mapping[str, np.ndarray]) -> "Motion":
        """Joint positions with drivers by name."""
        own = {name: values for name, values in drivers.items() if name in _OWN}
        return cls(q, **own, more={name: values for name, values in drivers.items() if name not in own})

    def take(self, rows: slice | np.ndarray) -> "Motion":
        return Motion.with_drivers(self.q[rows], {key: values[rows] for key, values in self.drivers.items()})

    def at(self, q: Float[np.ndarray, "rows n"]) -> "Motion":
        return replace(self, q=q)

    @property
    def drivers(self) -> dict[str, np.ndarray]:
        """Known quantities other than q, by name."""
        own = ((name, getattr(self, name)) for name in _OWN)
        return {name: values for name, values in own if values is not None} | dict(self.more)

    def need(self, driver: str, effect: str) -> np.ndarray:
        """A driver that an effect requires, complete in every row.

        Raises:
            DataError: it is missing; the message names the effect and the column to add.
        """
        values = self.drivers.get(driver)
        requested = COLUMNS[driver].requested if driver in COLUMNS else driver
        if values is None:
            text = f"effect '{effect}' needs the {driver} of every row; add the column {requested}"
            raise DataError(text, column=requested)
        if not (whole := np.isfinite(values if values.ndim == 1 else values.sum(1))).all():
            raise DataError(
                f"effect '{effect}' needs the {driver} of every row, and row {int(np.argmin(whole))} has "
                f"none; fill the column {requested} or exclude such rows",
                column=requested,
                row=int(np.argmin(whole)),
            )
        return values


_OWN = tuple(f.name for f in fields(Motion) if f.name not in ("q", "more"))
"""Drivers that have a field."""

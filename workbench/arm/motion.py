"""The state in which a robot is observed: what the laws of effects may depend on, one row per pose."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.base.errors import DataError, ShapeError
from workbench.base.types import frozen

COLUMNS = {
    "direction": "direction1, direction2 … (sign of each joint's last motion)",
    "time": "time[s]",
    "temperature": "temperature[degC]",
    "payload": "payload[kg]",
    "torque": "torque1[N*m], torque2[N*m] …",
}
"""What the columns of a measurement file that hold each driver are called."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Joint positions and whatever else is known of each row; None if unknown.

    Args:
        q: Joint positions [rad or m].
        direction: Sign of each joint's last motion (-1, 0, +1).
        payload: Mass at the tool [kg]; none if None.
        torque: Measured joint torques [N m].
        wrench: [f; τ] that pulls at the tool's origin from outside, in the axes of the robot's gravity
            [N, N m]; none if None.
        velocity: Joint velocities [rad/s or m/s]; at rest if None.
        acceleration: Joint accelerations [rad/s² or m/s²]; none if None.
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

    def __post_init__(self):
        for f in fields(self):
            value = getattr(self, f.name)
            if value is not None:
                if len(value) != len(self.q):
                    raise ShapeError(
                        f"'{f.name}' has {len(value)} rows, the joint positions {len(self.q)}; "
                        "give one for each",
                        expected=len(self.q),
                        found=len(value),
                    )
                object.__setattr__(self, f.name, frozen(value))

    def __len__(self) -> int:
        return len(self.q)

    @classmethod
    def of(cls, data: Any) -> "Motion":
        """The drivers of a table of measurements: its attributes of these names, as far as it has them."""
        drivers: dict[str, Any] = {f.name: getattr(data, f.name, None) for f in fields(cls)}
        return cls(**drivers)

    @classmethod
    def joined(cls, parts: Sequence["Motion"]) -> "Motion":
        """Rows of several tables, one after the other; a driver that one of them lacks is left out."""
        columns = {f.name: [getattr(part, f.name) for part in parts] for f in fields(cls)}
        return cls(**{
            name: np.concatenate(values)
            for name, values in columns.items()
            if all(value is not None for value in values)
        })  # fmt: skip

    def take(self, rows: slice | np.ndarray) -> "Motion":
        """The chosen rows."""
        return Motion(self.q[rows], **{name: values[rows] for name, values in self.drivers.items()})

    def at(self, q: Float[np.ndarray, "rows n"]) -> "Motion":
        """The same state at other joint positions."""
        return replace(self, q=q)

    @property
    def drivers(self) -> dict[str, np.ndarray]:
        """Whatever is known beside q, by name."""
        found = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "q"}
        return {name: values for name, values in found.items() if values is not None}

    def need(self, driver: str, effect: str) -> np.ndarray:
        """A driver that an effect can't do without, complete in every row.

        Raises:
            DataError: it is missing; names the effect and the column to add.
        """
        values = getattr(self, driver)
        if values is None:
            raise DataError(
                f"effect '{effect}' needs the {driver} of every row; add the column {COLUMNS[driver]}"
            )
        if not (whole := np.isfinite(values if values.ndim == 1 else values.sum(1))).all():
            raise DataError(
                f"effect '{effect}' needs the {driver} of every row, and row {int(np.argmin(whole))} has "
                f"none; fill the column {COLUMNS[driver]} or exclude such rows"
            )
        return values

"""Repeated contact of the tool point with points that stay where they are, wherever that is."""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observations.observation import AbstractObservation, Channel, Seen

PLANE = "plane"
"""How the name of a contact with a plane begins."""


def touches_plane(contact: np.ndarray) -> Bool[np.ndarray, " rows"]:
    """Which contacts are with planes, by their names."""
    return np.char.startswith(np.asarray(contact, str), PLANE)


@final
@dataclass(frozen=True, eq=False)
class ContactObservation(AbstractObservation):
    """Residual c − p̂ with the touched point's unknown place c in the measuring frame.

    Where the base stands can't be seen, and with a single point neither can the arm's scale.
    """

    contact: Int[np.ndarray, " rows"]
    names: tuple[str, ...]
    sees_base = False

    unused_words = "contacts"

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (Channel.POSITION,) * 3

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        if data.contact is None:
            return np.zeros(len(data), bool)
        return (data.contact != "") & ~touches_plane(data.contact)

    @classmethod
    def of(cls, data: Dataset) -> "ContactObservation":
        names, index = np.unique(np.asarray(data.contact), return_inverse=True)
        return cls(frozen(index.astype(np.int64)), tuple(names.tolist()))

    @property
    def unknowns(self) -> tuple[str, ...]:
        return tuple(f"contact[{name}].{axis}" for name in self.names for axis in "xyz")

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        return np.concatenate([poses[self.contact == k, :3, 3].mean(0) for k in range(len(self.names))])

    def see(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Seen:
        rows = np.arange(len(poses))
        residual = unknown.reshape(-1, 3)[self.contact] - poses[:, :3, 3]
        by_twist = np.concatenate([np.eye(3), np.zeros((3, 3))], axis=1) * np.ones((len(poses), 1, 1))
        by_unknown = np.zeros((len(poses), 3, len(self.names), 3))
        by_unknown[rows, :, self.contact] = -np.eye(3)
        return Seen(residual, by_twist, by_unknown.reshape(len(poses), 3, -1))

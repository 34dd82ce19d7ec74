"""Places that stay where they are, wherever that is: contacts of the tool point, or anchors at a distance.

Rows share places by name. A contact whose name begins with `plane` is one with a plane, any other one with a
point. A plane is named by its foot f, the point of it that is nearest to a reference point r: f has three
coordinates in metres and no singular orientation.

    contact with a point    residual = c − p̂,      c the point
    contact with a plane    residual = |f − r| − n·(p̂ − r),      n = (f − r)/|f − r|
    distance l              residual = l − o − |p̂ − c|,      c the anchor of a ball bar or wire sensor

The zero o of a draw wire, named in the column `draw_wire`, is unknown; that of other distances is 0.
Where the base stands can't be seen, and with a single point neither can the arm's scale.

Source: derived here; contact planes of this kind in Ikits & Hollerbach, IEEE ICRA 1997.
"""

from dataclasses import field
from typing import ClassVar, final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractObservation, Channel, Linearised

PLANE = "plane"
"""How the name of a contact with a plane begins, in either case."""
REFERENCE = frozen(np.array([-1.0, -1.0, -1.0]))
"""r in the measuring frame [m]; planes through it have no foot, and none that an arm touches goes there."""


class AbstractPlaceObservation(AbstractObservation):
    """Rows that share places by name, each place three unknown coordinates in the measuring frame.

    Args:
        place: Number of each row's place.
        names: Names of the places.
    """

    place: Int[np.ndarray, " rows"]
    names: tuple[str, ...]
    sees_base = False
    word: ClassVar[str]
    """The column of labels that names the places; without one all are a single place of that name."""

    @property
    def unknowns(self) -> tuple[str, ...]:
        return tuple(f"{self.word}[{name}].{axis}" for name in self.names for axis in "xyz")

    @classmethod
    def of(cls, data: Dataset) -> "AbstractPlaceObservation":
        labels = data.column(cls.word)
        labels = np.full(len(data), cls.word) if labels is None else labels
        names, place = np.unique(labels, return_inverse=True)
        numbers = (np.asarray(data.column(name)) for name in cls.columns)
        return cls(frozen(place.astype(np.int64)), tuple(names.tolist()), *numbers)

    def by_place(self, derivative: Float[np.ndarray, "rows m 3"]) -> Float[np.ndarray, "rows m u"]:
        """Changes per coordinate of a row's own place, as changes per unknown."""
        rows, m = derivative.shape[:2]
        out = np.zeros((rows, m, len(self.names), 3))
        out[np.arange(rows), :, self.place] = derivative
        return out.reshape(rows, m, -1)


def _touches_plane(data: Dataset) -> Bool[np.ndarray, " rows"]:
    names = np.full(len(data), "") if data.contact is None else np.char.lower(data.contact)
    return np.char.startswith(names, PLANE)


@final
class ContactObservation(AbstractPlaceObservation):
    """Contact of the tool point with points."""

    word = "contact"
    unused_text = "contacts"
    channels = (Channel.POSITION,) * 3

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        is_named = np.zeros(len(data), bool) if data.contact is None else data.contact != ""
        return is_named & ~_touches_plane(data)

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        return np.concatenate([poses[self.place == k, :3, 3].mean(0) for k in range(len(self.names))])

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        each = np.ones((len(poses), 1, 1))
        residual = unknown.reshape(-1, 3)[self.place] - poses[:, :3, 3]
        by_twist = np.concatenate([np.eye(3), np.zeros((3, 3))], axis=1) * each
        return Linearised(residual, by_twist, self.by_place(-np.eye(3) * each))


@final
class PlaneObservation(AbstractPlaceObservation):
    """Contact of the tool point with planes, whose feet are unknown."""

    word = "contact"
    unused_text = "contacts with planes"
    channels = (Channel.POSITION,)

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        return _touches_plane(data)

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        feet = []
        for k in range(len(self.names)):
            points = poses[self.place == k, :3, 3] - REFERENCE
            middle = points.mean(axis=0)
            normal = np.linalg.svd(points - middle)[2][-1]
            feet.append(REFERENCE + normal * (normal @ middle))
        return np.concatenate(feet)

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        foot = unknown.reshape(-1, 3)[self.place] - REFERENCE
        length = np.maximum(np.linalg.norm(foot, axis=1), 1e-12)
        normal = foot / length[:, None]
        tip = poses[:, :3, 3] - REFERENCE
        height = (normal * tip).sum(axis=1)
        by_twist = np.concatenate([normal, np.zeros_like(normal)], axis=1)[:, None]
        by_foot = (tip - height[:, None] * normal) / length[:, None] - normal
        return Linearised((length - height)[:, None], by_twist, self.by_place(by_foot[:, None]))


@final
class DistanceObservation(AbstractPlaceObservation):
    """Distance of the tool point from an anchor, and zeros of draw wires, of which a row has one or none."""

    distance: Float[np.ndarray, " rows"]
    of_wire: Float[np.ndarray, "rows w"] = field(default_factory=lambda: np.zeros((0, 0)))
    wires: tuple[str, ...] = ()
    columns = ("distance",)
    word = "anchor"
    unused_text = "distances"
    channels = (Channel.POSITION,)

    @classmethod
    def of(cls, data: Dataset) -> "DistanceObservation":
        wire = data.more.get("draw_wire", np.full(len(data), ""))
        names, places = np.unique(wire[wire != ""]), super().of(data)
        of_wire = frozen((wire[:, None] == names).astype(float))
        return cls(places.place, places.names, np.asarray(data.distance), of_wire, tuple(names.tolist()))

    @property
    def unknowns(self) -> tuple[str, ...]:
        return (*super().unknowns, *(f"wire[{name}].zero" for name in self.wires))

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        guess = np.zeros((len(self.names), 3))
        for k in range(len(self.names)):
            mine = self.place == k
            p = poses[mine, :3, 3]
            matrix = np.column_stack([2 * p, np.ones(len(p))])
            guess[k] = np.linalg.lstsq(matrix, (p**2).sum(1) - self.distance[mine] ** 2, rcond=1e-9)[0][:3]
        return np.append(guess, np.zeros(len(self.wires)))

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        places, zeros = np.split(unknown, [3 * len(self.names)])
        from_anchor = poses[:, :3, 3] - places.reshape(-1, 3)[self.place]
        length = np.maximum(np.linalg.norm(from_anchor, axis=1), 1e-12)
        direction = from_anchor / length[:, None]
        by_twist = np.concatenate([direction, np.zeros_like(direction)], axis=1)[:, None]
        by_unknown = np.concatenate([self.by_place(-direction[:, None]), self.of_wire[:, None]], axis=2)
        residual = self.distance - length - self.of_wire @ zeros
        return Linearised(residual[:, None], by_twist, by_unknown)

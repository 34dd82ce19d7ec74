"""Inclinometer on a link: where up is, as the link sees it; a turn about the vertical it can't see.

With û = R̂ᵀ e_z the upward direction in the link's axes, R̂ from the link to a level frame, and its reading u,

    residual = E (u − û) = −E û,      E two unit vectors across u

to first order the two angles between them. A file holds u as turns of the link about its own axes, those of
roll and pitch: u = (−sin y, cos y sin x, cos y cos x), x = tilt_x, y = tilt_y.

Beside positions, which show the arm's geometry better, the inclinometer of a link may be mounted askew: û is
turned by small unknown angles m, û − m × û. One on the base shows how the arm stands.

Source: derived here; inclinometers on links in Katana figs. 4.6 and 5.4.
"""

from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractObservation, Channel, Linearised, Unknown

ASKEW = float(np.deg2rad(1.0))
"""How far an inclinometer may be mounted askew, one standard deviation [rad]."""
UP = frozen(np.array([0.0, 0.0, 1.0]))


def upward(tilt: Float[np.ndarray, "*rows 2"]) -> Float[np.ndarray, "*rows 3"]:
    """Upward unit vectors in the link's axes from readings [rad]."""
    (sx, sy), (cx, cy) = np.sin(tilt).T, np.cos(tilt).T
    return np.stack([-sy, cy * sx, cy * cx], axis=-1)


def reading(up: Float[np.ndarray, "*rows 3"]) -> Float[np.ndarray, "*rows 2"]:
    """Readings [rad] of upward unit vectors in the link's axes: x in ±π, y in ±π/2."""
    x, y, z = np.moveaxis(up, -1, 0)
    return np.stack([np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))], axis=-1)


def seen_from(rotation: Float[np.ndarray, "*rows 3 3"]) -> Float[np.ndarray, "*rows 3"]:
    """Upward unit vectors in a link's axes from its rotations to a level frame."""
    return rotation[..., 2, :]


@final
class TiltObservation(AbstractObservation):
    """Rows of one inclinometer.

    Args:
        measured: Upward unit vectors in the link's axes.
        link: The moving link that carries it, counted from 1; 0 for the base.
        beside: Whether its rows carry another observation too.
    """

    measured: Float[np.ndarray, "rows 3"]
    link: int = 1
    beside: bool = False
    sees_base = False
    sees_tool = False

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (Channel.TILT if self.beside else Channel.ROTATION,) * 2

    @property
    def unknowns(self) -> tuple[str, ...]:
        mounted = self.beside and self.link > 0
        return tuple(f"tilt[{self.link}].{axis}" for axis in "xyz") if mounted else ()

    @property
    def known(self) -> dict[str, Unknown]:
        return dict.fromkeys(self.unknowns, Unknown("rad", 1.0, ASKEW))

    @property
    def seen(self) -> Bool[np.ndarray, "..."]:
        return np.repeat(np.isfinite(self.measured).all(1)[:, None], 2, axis=1)

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        links = (data.tilt or {}).values()
        return np.any([np.isfinite(t).all(-1) for t in links], axis=0) if links else np.zeros(len(data), bool)

    @classmethod
    def of(cls, data: Dataset) -> "TiltObservation":
        return cls.each(data)[0]

    @classmethod
    def each(cls, data: Dataset) -> tuple["TiltObservation", ...]:
        return tuple(cls(frozen(upward(t)), link) for link, t in sorted((data.tilt or {}).items()))

    @property
    def _across(self) -> Float[np.ndarray, "rows 2 3"]:
        """Two unit vectors across every reading: the axes nearest to the link's own."""
        u = np.where(np.isfinite(self.measured), self.measured, UP)
        first = np.eye(3)[np.abs(u).argmin(axis=1)]
        a = np.cross(u, first)
        a /= np.linalg.norm(a, axis=1, keepdims=True)
        return np.stack([a, np.cross(u, a)], axis=1)

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        rotation, across = poses[:, :3, :3], self._across
        askew = np.eye(3) - se3.skew(unknown) if len(unknown) else np.eye(3)
        up = seen_from(rotation)
        prediction = (across @ (up @ askew.T)[..., None])[..., 0]
        residual = np.where(self.seen, -prediction, 0.0)
        by_turn = across @ askew @ np.swapaxes(rotation, 1, 2) @ se3.skew(UP)
        by_turn = np.where(self.seen[..., None], by_turn, 0.0)
        by_twist = np.concatenate([np.zeros_like(by_turn), by_turn], axis=2)
        mounted = np.where(self.seen[..., None], across @ se3.skew(up), 0.0)[..., : len(unknown)]
        return Linearised(residual, by_twist, mounted)

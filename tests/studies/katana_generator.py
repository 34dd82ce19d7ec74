"""Virtual Katanas that owe nothing to the model: plain matrices, one link after the other.

A joint's row of the table is [α, a, β, θ, d], and its link

    A_i = Rot(x, α) Rot(y, β) Trans(x, a) Trans(z, d) · B_i · Rot(z, q + θ + ε_i(q))        (3.1), (3.2)

with the joint's tilt B_i right before its drive (4.9), (4.10): a turn by −c η/|η| across the axis for its
clearance, and by −b sign(η_z) − η_z/k about it for backlash and compliance, where η is the moment (4.21) that
holds what the deflected arm carries at rest. It tilts about where the three-rotation form has its joint,
behind d (4.4). Gravity has no moment about joint 1, whose play stays on one side. ε_i is a remainder that
neither constants nor tilting can hold: waves of the joint's own angle.

The sixth joint is inactive and carries the link with the targets.
"""

from dataclasses import dataclass

import numpy as np
from generator import four, move, rotation, turn
from jaxtyping import Float

from studies import katana_printed as printed

H = np.pi / 2
NOMINAL = np.array([
    [0, 0, 0, 0, 0], [H, 0, 0, 0, 0], [0, 0.190, 0, 0, 0], [0, 0.139, 0, 0, 0], [-H, 0, 0, 0, 0.1473],
    [H, 0, 0, 0, 0.200],
])  # fmt: skip
"""Table 3.1: α, a, β, θ, d of the six joints [rad, m]."""
CORNER = np.array([0.055, 0.055, 0.2015])
"""Where the first two axes meet, seen from the reference corner R, eq. (4.7) [m]."""
MASSES = np.array([1.2, 1.03, 0.9, 1.0, 0.8])
"""Table 4.2 [kg]; the first is not printed and carried by joint 1 alone, whose axis is vertical."""
CENTRES = np.array([[0, 0, -0.06], [0.1, 0, 0], [0.104, 0, 0], [0, 0.08, 0], [0, -0.07, 0]])
"""Table 4.2 in the link frames [m]."""
GRAVITY = np.array([0.0, 0.0, -9.81])
PLACES = (
    *((joint, 3) for joint in range(5)),
    *((joint, 0) for joint in range(6)),
    *((2, 2), (3, 2), (2, 1), (3, 1), (4, 4), (5, 4)),
)
"""Row and column in the table of the 17 constants of eq. (3.5)."""
ORDERS = (2, 3, 4, 5, 6, 7, 8)
"""Waves of a joint's remainder in a turn."""
ROUNDS = 12
"""Rounds in which the deflected arm finds its moments."""


@dataclass(frozen=True, eq=False, kw_only=True)
class VirtualKatana:
    """An arm with its errors.

    Args:
        table: α, a, β, θ, d of the six joints [rad, m].
        clearance: Tilt of each joint across its axis, to each side [rad].
        backlash: Play of each joint about its axis, to each side [rad].
        stiffness: Of each joint about its axis [N m/rad].
        waves: Sine and cosine of each joint's remainder, by order [rad].
    """

    table: Float[np.ndarray, "6 5"]
    clearance: Float[np.ndarray, "5"]
    backlash: Float[np.ndarray, "5"]
    stiffness: Float[np.ndarray, "5"]
    waves: Float[np.ndarray, "5 orders 2"]

    @property
    def errors(self) -> Float[np.ndarray, "17"]:
        """Errors of the constants of eq. (3.5) [rad, m]."""
        rows, columns = np.array(PLACES).T
        return (self.table - NOMINAL)[rows, columns]

    def poses(self, q: Float[np.ndarray, "rows 5"]) -> Float[np.ndarray, "rows 4 4"]:
        """Where the tool really is, seen from the reference corner [m]."""
        tilt = np.zeros((*q.shape, 3))
        for _ in range(ROUNDS):
            tilt = self._tilt(self._moments(*self._frames(q, tilt)))
        tool = self._frames(q, tilt)[1][:, -1].copy()
        tool[:, :3, 3] += CORNER
        return tool

    def _frames(self, q: np.ndarray, tilt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Frames before each drive, (rows, 5, 4, 4), and those of the links and the tool, (rows, 6, 4, 4)."""
        here = np.tile(np.eye(4), (len(q), 1, 1))
        before, links = [], []
        for joint, (alpha, a, beta, theta, d) in enumerate(self.table):
            here = here @ turn("x", alpha) @ turn("y", beta) @ move("x", a) @ move("z", d)
            if joint < 5:
                before.append(here)
                angle = q[:, joint] + theta + self._remainder(joint, q[:, joint])
                here = here @ four(rotation(tilt[:, joint])) @ turn("z", angle)
            else:
                here = here @ turn("z", theta)
            links.append(here)
        return np.stack(before, 1), np.stack(links, 1)

    def _moments(self, before: np.ndarray, links: np.ndarray) -> np.ndarray:
        """Moments that hold the links behind each joint against their weight, in its own axes [N m]."""
        places = np.einsum("rjab,jb->rja", links[:, :5, :3, :3], CENTRES) + links[:, :5, :3, 3]
        out = np.zeros((len(links), 5, 3))
        for joint in range(5):
            levers = places[:, joint:] - before[:, joint, None, :3, 3]
            load = np.cross(levers, MASSES[joint:, None] * GRAVITY).sum(axis=1)
            out[:, joint] = -np.einsum("rba,rb->ra", before[:, joint, :3, :3], load)
        return out

    def _tilt(self, held: np.ndarray) -> np.ndarray:
        """Rotation vectors by which the joints give way to what they hold, (rows, 5, 3) [rad]."""
        size = np.linalg.norm(held[:, :, :2], axis=2, keepdims=True)
        across = -self.clearance[:, None] * held[:, :, :2] / np.where(size > 0.0, size, 1.0)
        about = -self.backlash * np.sign(held[:, :, 2]) - held[:, :, 2] / self.stiffness
        about[:, 0] = 0.0
        return np.concatenate([across, about[:, :, None]], axis=2)

    def _remainder(self, joint: int, q: np.ndarray) -> np.ndarray:
        phase = np.outer(q, ORDERS)
        return np.sin(phase) @ self.waves[joint, :, 0] + np.cos(phase) @ self.waves[joint, :, 1]


def draw_arm(rng: np.random.Generator, *, play: float, remainder: float, share: float = 1.0) -> VirtualKatana:
    """An arm with errors of the size of Table 3.2 and the joints of Tables 4.3 and 4.4.

    Every constant's error is normal with its printed error as standard deviation.
    """
    table = NOMINAL.copy()
    rows, columns = np.array(PLACES).T
    table[rows, columns] += share * printed.TABLE_3_2 * rng.standard_normal(len(PLACES))
    size = remainder / np.sqrt(len(ORDERS))
    return VirtualKatana(
        table=table,
        clearance=play * printed.CLEARANCE,
        backlash=play * printed.BACKLASH,
        stiffness=printed.STIFFNESS,
        waves=size * rng.standard_normal((5, len(ORDERS), 2)),
    )

"""Virtual Katanas of the thesis: the tests' own arm and laws, its joints where the thesis has them.

    A_i = Rot(x, α) Rot(y, β) Trans(x, a) Trans(z, d) · B_i · Rot(z, q + θ + ε_i(q))        (3.1), (3.2)

A joint tilts by B_i where the three-rotation form has it, behind d (4.4), under the moment (4.21) that holds
what the deflected arm carries at rest. Gravity has no moment about joint 1, whose play stays on one side. ε_i
is a remainder that neither constants nor tilting can hold: waves of the joint's own angle. The sixth joint is
inactive and carries the link with the targets.
"""

from dataclasses import dataclass

import generator
import numpy as np
from diagnosis.laws import Effect, State, poses
from generator import I4, QUARTER, VirtualArm, move, turn
from jaxtyping import Float

from studies import katana_printed as printed

THETA, D, A, ALPHA, BETA = range(5)
PLACES = (
    *((joint, THETA) for joint in range(5)),
    *((joint, ALPHA) for joint in range(6)),
    *((2, BETA), (3, BETA), (2, A), (3, A), (4, D), (5, D)),
)
"""Row and column in the table of the 17 constants of eq. (3.5)."""
ORDERS = (2, 3, 4, 5, 6, 7, 8)
"""Waves of a joint's remainder in a turn."""


class ThesisArm(VirtualArm):
    """The arm of (3.1), whose joints begin behind d."""

    def parts(self, q):
        for angle, (theta, d, a, alpha, beta) in zip(q.T, self.table, strict=True):
            yield _before(d, a, alpha, beta), turn("z", angle + theta), I4


def _before(d, a, alpha, beta):
    return turn("x", alpha) @ turn("y", beta) @ move("x", a) @ move("z", d)


@dataclass(frozen=True, eq=False)
class VirtualKatana:
    """An arm as made, and what tilts or waves in it."""

    arm: ThesisArm
    effects: tuple[Effect, ...]

    def poses(self, q: Float[np.ndarray, "rows 5"]) -> Float[np.ndarray, "rows 4 4"]:
        """Where the tool really is, seen from the reference corner [m]."""
        zero = np.zeros(len(q))
        return poses(self.arm, self.effects, State(q, np.zeros(q.shape), zero, zero, zero))


def draw_arm(rng: np.random.Generator, *, play: float, remainder: float, share: float = 1.0) -> VirtualKatana:
    """An arm with errors of the size of Table 3.2 and the joints of Tables 4.3 and 4.4.

    Every constant's error is normal with its printed error as standard deviation.
    """
    nominal = generator.katana()
    table = np.vstack([nominal.table, [0.0, 0.2, 0.0, QUARTER, 0.0]])
    rows, columns = np.array(PLACES).T
    table[rows, columns] += share * printed.TABLE_3_2 * rng.standard_normal(len(PLACES))
    theta, *sixth = table[5]
    known = {"base": nominal.base, "masses": nominal.masses, "coms": nominal.coms}
    arm = ThesisArm("craig", table[:5], tool=_before(*sixth) @ turn("z", theta), **known)
    size = remainder / np.sqrt(len(ORDERS))
    waves = size * rng.standard_normal((5, len(ORDERS), 2))
    effects = [Effect("clearance-tilt", (j,), (play * printed.CLEARANCE[j],)) for j in range(5)]
    for j in range(1, 5):
        effects.append(Effect("backlash", (j,), (play * printed.BACKLASH[j],), "moment"))
        effects.append(Effect("joint-compliance", (j,), (1.0 / printed.STIFFNESS[j],)))
    for j, own in enumerate(waves):
        effects += [Effect("joint-harmonic", (j,), (c, s), k) for k, (s, c) in zip(ORDERS, own, strict=True)]
    return VirtualKatana(arm, tuple(effects))

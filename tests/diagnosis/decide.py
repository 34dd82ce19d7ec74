"""Which draws can be told apart by anybody: linear theory with the generator's own laws.

A draw is kept if, measured by 120 poses with the usual noise, what geometry cannot follow of each hidden
effect is `SHOWN` in noise units (root of the sum of squares of the whitened remainder), and still
`DISTINGUISHABLE` where a single rival, any other effect in any joint, has taken what it can. A joint that
carries no load shows nothing, and no diagnosis can be blamed for that. Rivals with more coefficients do not
count: the flexure of a link may contain the compliance of the joint after it, but the simpler name is right.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from generator import VirtualArm, four, rotation
from laws import NAMELESS, WHOLE, Effect, State, change, poses, turns

SHOWN, DISTINGUISHABLE = 20.0, 7.0
STEP = 1e-6
RANK = 1e-9
ORDERS = (1, 2, 3, 4, 5, 6)
COEFFICIENTS = {"joint-harmonic": 2, "link-flexure": 2, "base-drift": 6}


@dataclass(frozen=True, eq=False)
class Sight:
    """How small motions of an arm show in its measured poses, whitened, (6 rows, …).

    Args:
        arm: As made.
        state: Measured rows.
        free: Whether base and tool are unknown.
        sigma: Noise per axis [m, rad].
    """

    arm: VirtualArm
    state: State
    free: bool
    sigma: tuple[float, float]

    @cached_property
    def poses(self):
        """Of the arm that nothing bends."""
        return poses(self.arm, [], self.state)

    @cached_property
    def drives(self):
        """Transforms to right before each drive in the measuring frame, and the moments there."""
        before, links = self.arm.straight(self.state.q)
        state = self.state
        return self.arm.base @ before, self.arm.holding(before, links, state.payload, state.wrench)

    def displacement(self, effect):
        """Of the tool by one effect (6 rows,)."""
        if effect.name in WHOLE:
            return self._white(change(poses(self.arm, [effect], self.state), self.poses))
        before, held = self.drives
        bend = turns(self.arm, effect, self.state, held)
        shift = bend * (self.arm.sliding[:, None] & np.array([False, False, True]))
        joints = np.flatnonzero(bend.any((0, 2)))
        axes, lever = before[joints, :, :3, :3], self.poses[:, :3, 3] - before[joints, :, :3, 3]
        turned, moved = (
            (axes @ v[:, joints].swapaxes(0, 1)[..., None])[..., 0] for v in (bend - shift, shift)
        )
        return self._white(np.hstack([(np.cross(turned, lever) + moved).sum(0), turned.sum(0)]))

    def columns(self, effect):
        """Per coefficient of an effect (6 rows, c)."""
        units = STEP * np.eye(coefficients(effect))
        return np.column_stack([self.displacement(replace(effect, size=tuple(u.tolist()))) for u in units])

    @cached_property
    def geometry(self):
        """Per constant of the arm, of base and tool where they are free (6 rows, p)."""
        moved = []
        for place in np.argwhere(self.arm.proper()):
            table = self.arm.table.copy()
            table[tuple(place)] += STEP
            moved.append(replace(self.arm, table=table).pose(self.state.q))
        for part in STEP * np.eye(6) if self.free else ():
            small, base = four(rotation(part[3:]), part[:3]), self.arm.base
            moved += [base @ small @ np.linalg.inv(base) @ self.poses, self.poses @ small]
        return np.column_stack([self._white(change(m, self.poses)) for m in moved])

    def left(self, effect, others):
        """What geometry and other effects, at their sizes, leave of an effect, and the basis they span."""
        basis = _basis(np.column_stack([self.geometry, *(self.displacement(e) for e in others)]))
        return _beside(basis, self.displacement(effect)), basis

    def beside_geometry(self, moved, still):
        """What geometry leaves of the way from some poses of these rows to others, in noise units."""
        return float(np.linalg.norm(_beside(_basis(self.geometry), self._white(change(moved, still)))))

    def _white(self, twists):
        return (twists / np.repeat(self.sigma, 3)).ravel()


def decidable(sight: Sight, effects):
    """Whether every hidden effect shows beside geometry, the others and any rival."""
    for effect in effects:
        left, basis = sight.left(effect, [e for e in effects if e is not effect])
        if np.linalg.norm(left) < SHOWN:
            return False
        for rival in _rivals(sight.arm, effect):
            taken = _basis(_beside(basis, sight.columns(rival)))
            if np.linalg.norm(_beside(taken, left)) < DISTINGUISHABLE:
                return False
    return True


def shows(sight: Sight, effect, effects):
    """Whether one of several effects shows beside geometry and the others."""
    left, _ = sight.left(effect, [e for e in effects if e is not effect])
    return bool(np.linalg.norm(left) >= SHOWN)


def catalogue(arm, orders=ORDERS):
    """Every effect of the catalogue in every joint that can have it."""
    joints, turning = ([(int(j),) for j in np.flatnonzero(m)] for m in (arm.sliding | True, ~arm.sliding))
    found = [Effect("thermal-growth"), Effect("base-drift")]
    for name in ("joint-compliance", "bearing-compliance", "clearance-tilt", "encoder-scale"):
        found += [Effect(name, j) for j in joints]
    found += [Effect("link-flexure", j) for j in turning]
    found += [Effect("backlash", j, detail=cause) for j in joints for cause in ("moment", "motion")]
    found += [Effect("joint-harmonic", j, detail=k) for j in turning for k in orders]
    pairs = [(i, k) for i in range(arm.dof) for k in (i - 1, i + 1) if 0 <= k < arm.dof]
    return found + [Effect("joint-coupling", pair) for pair in pairs]


def _rivals(arm, effect):
    """The catalogue without the effect itself, and without what has more coefficients and may contain it.

    A wobbling mount is mostly the tilt of joint 1, which may stand for it.
    """
    near = [effect.detail + k for k in (-2, -1, 1, 2)] if isinstance(effect.detail, int) else []
    orders = sorted({*ORDERS, *(k for k in near if k > ORDERS[-1])})
    found = [r for r in catalogue(arm, orders) if coefficients(r) <= coefficients(effect)]
    if effect.name == "wobbling mount":
        return [r for r in found if r.joints != (0,)]
    me = (effect.name, effect.joints, effect.detail)
    return [r for r in found if (r.name, r.joints, r.detail) != me]


def coefficients(effect):
    """How many coefficients an effect of the catalogue has; those without a name as many as any."""
    return 6 if effect.name in NAMELESS else COEFFICIENTS.get(effect.name, 1)


def _basis(vectors):
    """Orthonormal columns that span the given ones, up to rounding."""
    vectors = vectors / np.maximum(np.linalg.norm(vectors, axis=0), 1e-300)
    if vectors.shape[1] == 1:
        return vectors
    u, s, _ = np.linalg.svd(vectors, full_matrices=False)
    return u[:, s > RANK * max(s[0], 1e-300)]


def _beside(basis, vectors):
    """What the basis leaves of vectors."""
    return vectors - basis @ (basis.T @ vectors)

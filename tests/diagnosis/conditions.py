"""What a workshop does not promise: right masses in the file, normal noise, random poses.

    case = under(Conditions(masses=0.3, coms=0.01), "compliance", seed=TUNING[0], arm="aria")

Every condition breaks an assumption that the diagnosis makes. The hidden arm and its effects stay those of
`arms.make` for the same kind, seed and arm; what changes is what the program is told of them.
"""

from dataclasses import dataclass, replace

import numpy as np
from arms import MORPHOLOGIES, SIGMA, make, robot_of, states
from cases import CASES, Case, required
from decide import Sight, decidable, shows
from generator import rotation
from laws import State, straight_moments, wound
from laws import poses as deflected_poses

GRID = 5
"""Positions of each joint on a grid of poses."""
MANY = 3000
"""Poses among which those in half of the joints' range are found."""


@dataclass(frozen=True)
class Conditions:
    """What differs from the ideal case.

    Args:
        masses: Greatest relative error of the masses in the robot's file.
        coms: Greatest error of each centre of mass in the file, per axis [m].
        tails: Degrees of freedom of Student's t that the noise follows, at the same scale; None: normal.
        stated: Noise that the file states in sigma columns, per real noise; None: no such columns.
        spread: Width of the log-normal factor by which stated sigmas differ from row to row.
        joint_noise: Standard deviation of the logged joint angles [rad].
        poses: How many rows.
        choice: `random`, `grid` (few positions of each joint), or `half` (half of each joint's range).
        point: Positions without orientation.
        noise: Times the usual noise.
        free: Whether base and tool are unknown.
    """

    masses: float = 0.0
    coms: float = 0.0
    tails: float | None = None
    stated: float | None = None
    spread: float = 0.0
    joint_noise: float = 0.0
    poses: int = 120
    choice: str = "random"
    point: bool = False
    noise: float = 1.0
    free: bool = False

    @property
    def sigma(self) -> tuple[float, float]:
        """Noise per axis [m, rad]."""
        return self.noise * SIGMA[0], self.noise * SIGMA[1]


CONDITIONS = {
    "ideal": Conditions(),
    "masses10": Conditions(masses=0.1, coms=0.01),
    "masses30": Conditions(masses=0.3, coms=0.01),
    "t3": Conditions(tails=3.0),
    "stated3": Conditions(stated=1 / 3),
    "overstated3": Conditions(stated=3.0),
    "sigma10": Conditions(stated=0.1, spread=0.7),
    "joints": Conditions(joint_noise=2e-4),
    "few": Conditions(poses=40),
    "point": Conditions(point=True),
    "grid": Conditions(choice="grid"),
    "half": Conditions(choice="half"),
    "free": Conditions(free=True),
    "noise3": Conditions(noise=3.0),
}
"""Conditions by the names that the benchmark takes."""


def under(given: Conditions, kind: str, seed: int, arm: str = "aria") -> Case:
    """A case of `arms.make` as it is met under some conditions; arguments as there."""
    case = make(kind, seed, arm, poses=given.poses, free_frames=given.free)
    rng = np.random.default_rng([seed, 77])
    state = _chosen(case, given, rng)
    stated = MORPHOLOGIES[arm]()
    masses = stated.masses * (1.0 + given.masses * rng.uniform(-1.0, 1.0, stated.dof))
    coms = stated.coms + given.coms * rng.uniform(-1.0, 1.0, (stated.dof, 3))
    stated = replace(stated, masses=masses, coms=coms)  # as a data sheet has them
    seen = deflected_poses(case.actual, case.hidden, state)
    size = len(seen), 6
    noise = rng.standard_normal(size) if given.tails is None else rng.standard_t(given.tails, size)
    noise *= np.repeat(given.sigma, 3)
    seen[:, :3, 3] += noise[:, :3]
    seen[:, :3, :3] = rotation(noise[:, 3:]) @ seen[:, :3, :3]
    data = replace(
        case.data.take(np.arange(len(seen))),
        q=state.q + given.joint_noise * rng.standard_normal(state.q.shape),
        position=seen[:, :3, 3],
        rotation=None if given.point else seen[:, :3, :3],
        time=state.time,
        temperature=state.temperature,
        direction=state.direction,
        payload=state.payload if case.data.payload is not None else None,
        sigma=_stated(given, rng, len(seen)),
    )
    return replace(
        case,
        robot=robot_of(stated, arm, given.free),
        data=data,
        exact=case.exact.take(_sides_agree(case, stated)),
        state=state,
        misseated=(),
        sigma=given.sigma,
        seen=_seen(case, given, state),
    )


def _sides_agree(case: Case, filed) -> np.ndarray:
    """Noise-free rows whose loose joints lie, by the file's masses, where they are in their play."""
    rows, agree = case.exact, np.ones(len(case.exact), bool)
    payload = np.zeros(len(rows)) if rows.payload is None else rows.payload
    state = State(rows.q, rows.direction, rows.time, rows.temperature, payload)
    arms = case.actual, replace(case.actual, masses=filed.masses, coms=filed.coms)
    sides = [np.sign(straight_moments(arm, state)[:, :, 2]) for arm in arms]
    for effect in case.hidden:
        if effect.name == "backlash" and effect.detail == "moment":
            agree &= sides[0][:, effect.joints[0]] == sides[1][:, effect.joints[0]]
    return agree


def _seen(case: Case, given: Conditions, state: State) -> bool:
    """Whether these rows show what is hidden, beside geometry and any rival."""
    sigma = given.sigma if not given.point else (given.sigma[0], np.inf)
    sight = Sight(case.actual, state, given.free, sigma)
    if CASES[case.kind].everywhere:
        requested = [e for e in case.hidden if required(e) in case.truth]
        return all(shows(sight, e, case.hidden) for e in requested)
    return decidable(sight, case.hidden)


def _chosen(case: Case, given: Conditions, rng: np.random.Generator) -> State:
    """Rows of the case's state, or the same state at poses that are chosen otherwise."""
    state = case.state
    if given.choice == "half":
        state = states(case.actual, MANY, rng, (state.payload.min(), state.payload.max()))
        low, high = state.q.min(0), state.q.max(0)
        middle = rng.uniform(low + 0.25 * (high - low), high - 0.25 * (high - low))
        near = np.abs(state.q - middle) / (high - low)
        return state.take(np.sort(np.argsort(near.max(1), kind="stable")[: given.poses]))
    if given.choice == "grid":
        low, high = np.quantile(state.q, [0.05, 0.95], axis=0)
        step = (high - low) / (GRID - 1)
        q = low + step * np.round((np.clip(state.q, low, high) - low) / step)
        path = np.vstack([q[:1], q])
        direction = np.sign(np.diff(path, axis=0))
        direction = np.where(direction == 0.0, state.direction, direction)
        return replace(state, q=q, direction=direction, wound=wound(path)).take(slice(0, given.poses))
    return state.take(slice(0, given.poses))


def _stated(given: Conditions, rng: np.random.Generator, rows: int) -> np.ndarray | None:
    """Sigma columns as an instrument writes them."""
    if given.stated is None:
        return None
    factor = given.stated * np.exp(given.spread * rng.standard_normal((rows, 1)))
    return factor * np.repeat(given.sigma, 3)

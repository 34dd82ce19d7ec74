"""Poses to measure next: those that best separate confounded effects, or reduce their uncertainty.

Candidates are random poses within the measured joint ranges, free of self-collision. Poses are added one at a
time to the information matrix of geometry, accepted effects and their rivals: each maximises the log
determinant for the parameters of interest, the others being eliminated (Ds-optimality).

Source: Atkinson, Donev, Tobias, Optimum experimental designs, with SAS, 2007, section 10.3.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.types import JointRows
from workbench.data.dataset import Dataset
from workbench.diagnosis.search.candidates import candidate_columns, carriers
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import observed_kinds
from workbench.plate.exchange import by_determinant, covariance_of

CANDIDATE_POSES = 400
"""Number of candidate poses …"""
MAX_CANDIDATE_UNKNOWNS = 100_000
"""… or fewer, so that poses times unknowns stay below this."""
MAX_MEASURED_ROWS = 2000
"""Number of measured rows, evenly spread, that represent all of them."""
BOX_MARGIN = 0.1
"""Share of the measured box by which a pose may lie outside it."""
MIN_CLEARANCE = 0.01
"""Minimum clearance between links [m]."""
OPEN_ERROR = 100.0
"""Standard error, relative to that from one average row, above which an unknown is unobservable."""
MIN_CORRELATION = 0.3
"""Correlation above which a pose is said to separate two unknowns."""
PRIOR_INFORMATION = 1e-8
"""Relative information added as a prior, so that unobservable parameters can be requested."""
Measurable = Callable[[JointRows], Bool[np.ndarray, " rows"]]
"""Whether postures can be measured."""


@dataclass(frozen=True)
class NextReason:
    """Why a pose should be measured.

    Args:
        sentence: What it determines, and by how much the standard error decreases.
        shrinks_to: That standard error afterwards, relative to before.
    """

    sentence: str
    shrinks_to: float


def next_poses(
    problem: Problem,
    x: Float[np.ndarray, " p"],
    effects: Sequence[AbstractEffect],
    *,
    rng: np.random.Generator,
    count: int = 5,
    measurable: Measurable | None = None,
) -> tuple[Float[np.ndarray, "_ n"], tuple[NextReason, ...]]:
    """Joint positions [rad or m] to measure next, each with a reason that assumes that those before are.

    Args:
        effects: Effects of interest; the geometry as a whole if empty.
        measurable: Whether postures can be measured; all reachable ones if None.
    """
    if problem.data.torque is not None and not problem.robot.has_masses:
        return problem.data.q[:0], ()  # the loads of other poses are unknown
    pool = _pool(problem, x, rng, max(min(CANDIDATE_POSES, MAX_CANDIDATE_UNKNOWNS // len(x)), 50), measurable)
    if not len(pool.q):
        return pool.q, ()
    requested = carriers(effects)
    unmeasured = problem.again(data=pool, noise=problem.typical_noise, inertia=False)
    some = problem.data.take(np.arange(0, len(problem.data), -(-len(problem.data) // MAX_MEASURED_ROWS)))
    measured = problem.again(data=some, noise=problem.noise)
    now, new = (_columns(problem, x, p, requested) for p in (measured, unmeasured))
    now *= np.sqrt(len(problem.data) / len(measured.data))
    new = new[np.argsort(unmeasured.component_rows, kind="stable")]
    # otherwise weakly observable parameters would outweigh all others beyond rounding
    new_size = np.linalg.norm(new, axis=0) / np.sqrt(len(pool))
    scale = np.maximum(np.hypot(np.linalg.norm(now, axis=0), new_size), 1e-12)
    now /= scale
    information = now.T @ now
    information[np.diag_indices(len(information))] += PRIOR_INFORMATION
    per_pose = (new / scale).reshape(len(pool), -1, len(scale))
    known = len(scale) - sum(len(e.names) for e in requested) if requested else 0

    def after(chosen: list[int]) -> np.ndarray:
        """The information once some poses are measured."""
        rows = per_pose[chosen].reshape(-1, len(scale))
        return information + rows.T @ rows

    alone = np.eye(len(pool), dtype=bool)
    exchange = by_determinant(per_pose, clash=alone, before=information, nuisance=known)
    chosen = exchange.fill(count)
    steps = pairwise(covariance_of(after(chosen[:k])) for k in range(len(chosen) + 1))
    unknowns = _unknowns(problem, requested)
    reasons = tuple(_reason(*step, known=known, unknowns=unknowns) for step in steps)
    return pool.q[chosen], reasons


def _unknowns(problem: Problem, requested: Sequence[AbstractEffect]) -> list[tuple[str, str]]:
    """Parameters and coefficients for people, and whose each is, in the order of the columns."""
    found = [(p.text, p.name) for p in problem.parameters if p.is_plain]
    for effect in requested:
        alone, shared = (effect.phrase, effect.label), f"{effect.name} ({{}})"
        for name in effect.names:
            several = shared.format(name.partition(".")[0]), name
            found.append(alone if len(effect.joints) < 2 else several)
    return found


def _reason(
    before: np.ndarray, after: np.ndarray, *, known: int, unknowns: Sequence[tuple[str, str]]
) -> NextReason:
    """The parameter of interest that a pose improves most, and the one from which it separates it best."""
    old, new = (np.sqrt(np.diag(c)) for c in (before, after))
    best = known + int(np.argmin((new / old + (new > OPEN_ERROR))[known:]))
    (name, owner), shrinks_to = unknowns[best], float(new[best] / old[best])
    alike = np.abs(before[best]) / (old * old[best])
    alike[[whose == owner for _, whose in unknowns]] = 0.0
    other = int(np.argmax(alike))
    if old[best] > OPEN_ERROR:
        return NextReason(f"is a step to make {name} observable", shrinks_to)
    parts = f"separates {name} from {unknowns[other][0]}"
    verb = parts if alike[other] > MIN_CORRELATION else f"sharpens {name}"
    return NextReason(f"{verb}: ± {100.0 * (1.0 - shrinks_to):.0f} % smaller", shrinks_to)


def _columns(problem: Problem, x: np.ndarray, rows: Problem, effects: Sequence[AbstractEffect]) -> np.ndarray:
    """Whitened columns of a problem's geometry, and of effects, for its rows.

    Rows of one session do not depend on the frames of others: their columns are zero.
    """
    here = rows.at(problem.named(x))
    plain = [p.name for p in problem.parameters if p.is_plain]
    mine = np.array([name in plain for name in rows.names])
    geometry = np.zeros((rows.size, len(plain)))
    own = [piece.jacobian for _, piece in rows.pieces(here, only=mine)]
    geometry[:, [plain.index(name) for name in rows.names if name in plain]] = np.concatenate(own)
    parts = [columns.table for _, columns in candidate_columns(rows, here, effects)]
    return np.concatenate([geometry, np.concatenate(parts)], axis=1)


def _pool(
    problem: Problem, x: np.ndarray, rng: np.random.Generator, size: int, measurable: Measurable | None
) -> Dataset:
    """Poses within the measured joint ranges, as the most common instrument would observe them, with typical
    drivers: the tool near the measured positions, the links no closer than in the measured poses."""
    from workbench.plate.optimiser.capsules import capsule_arm  # coal takes long to load

    data, arm = problem.data, problem.robot_at(x).with_effects()
    low, high = data.q.min(0), data.q.max(0)
    session = data.sessions[0]
    arm = problem.frames.placed(arm, data.sessions).in_session(session)
    q = rng.uniform(low, high, (8 * size, data.joints))
    seen, tips = (tool_poses(arm, Motion(postures))[:, :3, 3] for postures in (data.q, q))
    margin = BOX_MARGIN * np.ptp(seen, axis=0)
    q = q[((tips >= seen.min(0) - margin) & (tips <= seen.max(0) + margin)).all(1)]
    q = q[: 2 * size] if measurable is None else q[np.asarray(measurable(q), bool)]
    shape = capsule_arm(arm)
    closest = min(float(shape.own_distances(shape.placements(data.q)).min()), MIN_CLEARANCE)
    q = q[shape.own_distances(shape.placements(q), minimum=closest) >= closest][:size]
    maximum = max((rows for _, rows in observed_kinds(data)), key=len)
    like = data.take(np.resize(maximum, len(q)))
    poses, p, r = tool_poses(arm, Motion(q)), like.position, like.rotation
    return replace(
        like,
        q=q,
        row=np.arange(len(q)),
        position=None if p is None else np.where(np.isfinite(p), poses[:, :3, 3], np.nan),
        rotation=None if r is None else np.where(np.isfinite(r), poses[:, :3, :3], np.nan),
        session=None if like.session is None else np.full(len(q), session),
        group=None,
        torque=None,
        sigma=None,
    )

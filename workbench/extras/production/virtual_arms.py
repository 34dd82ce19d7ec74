"""Many virtual arms at once: made with errors, moved to the targets, calibrated and judged, as stacks.

All arms share one chain; what an arm has in addition to the nominal constants enters as the chain's `shift`,
row by row, so that a stack of arms is no more than a stack of rows:

    made       δ even within ±1 mm, ±0.3°, or what is given, of every constant
    measured   q of the actual arm at the actual target, nearest to the nominal arm's (`reach_targets`)
    calibrated δ̂ by damped Gauss–Newton on Σ |S⁻¹ (y − k(q, δ̂))|² over the targets that the arm reaches
    judged     e = k(q, δ) − k(q, δ̂) at poses of the region that took no part

Source: ARIA §4.1.2 (second way of acquisition), eqs. (19)–(21), §2.4 eq. (3).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm import chain as chains
from workbench.arm.chain import Chain
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.extras.production.reach_targets import Reached, reach_targets
from workbench.extras.production.yield_inputs import YieldJob

CHUNK = 250
"""Arms that are computed as one stack, with one seed."""
CALIBRATING = 16
"""Maximum number of Gauss–Newton steps."""
TOLERANCE = 1e-9
"""A calibration has settled when no constant moves by more than this [m, rad]."""


@dataclass(frozen=True, eq=False)
class Chunk:
    """What became of some arms.

    Args:
        met: Whether each target was met within the arm's joint limits.
        position: Root mean square position error of each arm over its tests [m].
        rotation: The same of the orientation [rad].
        worst: Maximum error of each arm along any axis: position [m] and rotation [rad].
        used: Each arm's largest error as a share of what the requirement allows.
        planned: Arms that met all targets in the planned branches.
        squares: Sum over these of the squared position [m²] and rotation error [rad²] at each pose of the
            bank.
        counts: How many of them were judged there.
    """

    met: Bool[np.ndarray, "arms targets"]
    position: Float[np.ndarray, " arms"]
    rotation: Float[np.ndarray, " arms"]
    worst: Float[np.ndarray, "arms 2"]
    used: Float[np.ndarray, " arms"]
    planned: Bool[np.ndarray, " arms"]
    squares: Float[np.ndarray, "rows 2"]
    counts: Int[np.ndarray, " rows"]


def try_arms(job: YieldJob, seed: np.random.SeedSequence, arms: int = CHUNK) -> Chunk:
    """Make, measure, calibrate and judge some arms."""
    rng = np.random.default_rng(seed)
    actual = job.errors.undeclared or job.robot
    made = _made(job, actual.chain, arms, rng)
    targets = _actual_targets(job, arms, rng)
    reached = reach_targets(actual, made, targets, branches=job.branches, constrained=job.constrained)
    readings = reached.q + rng.normal(0.0, job.errors.joint, reached.q.shape)
    found = _calibrate(job, readings, reached.met)
    tests = rng.integers(0, len(job.bank), (arms, job.tests))
    errors = _errors(job, actual, made, found, tests)
    return _judged(job, reached, tests, errors)


def _made(job: YieldJob, chain: Chain, arms: int, rng: np.random.Generator) -> np.ndarray:
    """Manufacturing errors of every element of the actual chain."""
    turns = np.array([chain.elements[i].axis.turns for i in chain.indices(job.names)], bool)
    shift = np.zeros((arms, len(chain.elements)))
    bounds = np.where(turns, job.angle, job.length)
    shift[:, chain.indices(job.names)] = rng.uniform(-1.0, 1.0, (arms, len(turns))) * bounds
    return shift


def _actual_targets(
    job: YieldJob, arms: int, rng: np.random.Generator
) -> Float[np.ndarray, "arms targets 4 4"]:
    """Poses that the seats impose: off by the plate's production errors and play, and anew by each seating.

    A ball-bar puts the tool where its readings have it: off by them, and by the anchors alike for all.
    """
    errors, shape = job.errors, (arms, len(job.q), 3)
    play = errors.played
    position = rng.normal(size=shape) * np.hypot(errors.target_position, play[:, 0])[:, None]
    rotation = rng.normal(size=shape) * np.hypot(errors.target_rotation, play[:, 1])[:, None]
    if errors.away is None:
        position += rng.normal(size=shape) * errors.seat_position
    else:
        anchors = errors.anchor * rng.normal(size=(arms, *errors.away.shape[1:]))
        lengths = np.einsum("tki,aki->atk", errors.away, anchors)
        lengths += errors.seat_position * rng.normal(size=lengths.shape)
        position += np.einsum("tij,tkj,atk->ati", errors.spread, errors.away, lengths, optimize=True)
    rotation += rng.normal(size=shape) * errors.seat_rotation
    turned = se3.rotvec_to_matrix(rotation) @ job.poses[:, :3, :3]
    return se3.pose(turned, job.poses[:, :3, 3] + position)


def _calibrate(
    job: YieldJob, readings: Float[np.ndarray, "arms targets n"], met: Bool[np.ndarray, "arms targets"]
) -> Float[np.ndarray, "arms p"]:
    """Identified errors of the constants, the plate taken as true, a ball-bar's anchors solved for.

    Steps are damped by what is known beforehand (`Job.prior`), so that what the targets leave open stays near
    nominal. It is no fixed set of directions: a socket on the last axis shows nothing of that joint's angle
    at the nominal arm, but a made arm has the socket beside its axis.
    """
    arms, count, _ = readings.shape
    chain, columns = job.robot.chain, job.robot.chain.indices(job.names)
    q, nominal = readings.reshape(arms * count, -1), np.tile(job.poses, (arms, 1, 1))
    weights = np.where(job.constrained & met[..., None], 1.0 / job.sigma, 0.0)
    beside, p = np.broadcast_to(-job.anchored, (arms, *job.anchored.shape)), len(columns)
    known = np.full(beside.shape[-1], 1.0 / (job.errors.anchor or 1.0) ** 2)
    pull = np.append(np.zeros(p), known)
    found = np.zeros((arms, p + len(known)))
    for _ in range(CALIBRATING):
        at, twists = chains.twists(chain, q, columns, shift=_spread(chain, columns, found[:, :p], count))
        residual = se3.pose_error(nominal, at).reshape(arms, -1) - (
            beside.reshape(arms, count * 6, -1) @ found[:, p:, None]
        ).reshape(arms, -1)
        rows = np.concatenate([twists.reshape(arms, count, 6, -1), beside], axis=3) * weights[..., None]
        rows = rows.reshape(arms, count * 6, -1)
        across = np.swapaxes(rows, 1, 2)
        right = across @ (residual * weights.reshape(arms, -1))[..., None] - (pull * found)[..., None]
        step = np.linalg.solve(across @ rows + np.diag(np.append(job.prior, known)), right)[..., 0]
        found = found + step
        if np.abs(step).max() < TOLERANCE:
            break
    return found[:, :p]


def _spread(chain: Chain, columns: np.ndarray, found: np.ndarray, count: int) -> np.ndarray:
    """Errors of some constants as a shift of the whole chain, for so many rows of each arm."""
    shift = np.zeros((len(found) * count, len(chain.elements)))
    shift[:, columns] = np.repeat(found, count, axis=0)
    return shift


def _errors(
    job: YieldJob, actual: Robot, made: np.ndarray, found: np.ndarray, tests: np.ndarray
) -> Float[np.ndarray, "arms tests 6"]:
    chain, columns = job.robot.chain, job.robot.chain.indices(job.names)
    q = job.bank[tests.ravel()]
    shift = np.repeat(made, tests.shape[1], axis=0) + job.bend[tests.ravel()]
    there = chains.poses(actual.chain, q, shift=shift)
    model = chains.poses(chain, q, shift=_spread(chain, columns, found, tests.shape[1]))
    return se3.pose_error(there, model).reshape(*tests.shape, 6)


def _judged(job: YieldJob, reached: Reached, tests: np.ndarray, errors: np.ndarray) -> Chunk:
    squares = np.stack([(errors[..., :3] ** 2).sum(-1), (errors[..., 3:] ** 2).sum(-1)], -1)
    axes = np.abs(errors)
    rows, judged = len(job.bank), tests[reached.planned].ravel()
    sums = [np.bincount(judged, part[reached.planned].ravel(), rows) for part in np.moveaxis(squares, -1, 0)]
    position, rotation = np.sqrt(squares.mean(1)).T
    return Chunk(
        met=reached.met,
        planned=reached.planned,
        position=position,
        rotation=rotation,
        worst=np.stack([axes[..., :3].max((1, 2)), axes[..., 3:].max((1, 2))], -1),
        used=job.wanted.used_by(errors[..., :3], errors[..., 3:]).max(1),
        squares=np.stack(sums, -1),
        counts=np.bincount(judged, minlength=rows),
    )

"""Candidates for an arm, all that registered effects offer for its joints and the rows, and their columns.

Candidates that can't be tried are reported with the reason. Columns are derivatives of every residual
component with respect to effect coefficients: the sum of an effect's elements' twists times its law, mapped
by the block's observation and whitened; the moments are those of the arm deflected by the accepted effects.
The dependence of the moments on the new deflection is neglected: it is of second order, and refits do not
use these columns.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.effects import EFFECTS, AbstractEffect, Candidate
from workbench.arm.effects.effect import NO_WRENCHES, moved_joints
from workbench.arm.frame import revised
from workbench.arm.kinematics.forward import watched
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import deflect, law_sizes
from workbench.arm.statics.wrenches import load_regressor, motion_wrenches, own_axis
from workbench.base.threads import in_order
from workbench.identification.column_products import Columns
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import RowBlock
from workbench.parts import warn_of_broken

MIN_DRIVEN_SHARE = 0.01
"""Share of the largest joint's law below which a joint counts as not driven."""


@dataclass(frozen=True, eq=False)
class Catalogue:
    """Candidates to try.

    Args:
        candidates: Effects with zero coefficients.
        notes: Candidates that can't be tried, and why, one sentence each.
    """

    candidates: tuple[Candidate, ...]
    notes: tuple[str, ...]


def catalogue(robot: Robot, motion: Motion) -> Catalogue:
    """All candidates that some rows could show, but for effects that the arm already has."""
    offers = [offer for kind in EFFECTS.values() for offer in _offers(kind, robot, motion)]
    found = (offer for offer in offers if isinstance(offer, Candidate))
    own = set(robot.coefficients)
    sized = (_alike(c, robot, motion) if c.alike else c for c in found if not own & set(c.names))
    kept = [c for c in sized if c is not None and c.effect.mistake(robot.chain) is None]
    if any(c.effect.has_play and c.effect.loads for c in kept):
        loads = known_wrenches(robot, motion)
        kept = [replace(c, effect=c.effect.softened(robot.chain, loads)) for c in kept]
    notes = [*_still(motion), *(offer for offer in offers if isinstance(offer, str))]
    return Catalogue(tuple(kept), tuple(dict.fromkeys(notes)))


def _offers(kind: type[AbstractEffect], robot: Robot, motion: Motion) -> list[Candidate | str]:
    """What a kind of effect offers; nothing if another package's raises, and a warning names it."""
    if kind.__module__.startswith("workbench."):
        return list(kind.offers(robot, motion))
    try:
        offers = list(kind.offers(robot, motion))
        for offer in offers:
            if isinstance(offer, Candidate):
                law_sizes(robot.with_effects(offer.effect), motion, offer.effect.names)
    except Exception as error:  # whatever is wrong with somebody else's package
        warn_of_broken(f"the effect {kind.__name__}", error)
        return []
    return offers


def _alike(candidate: Candidate, robot: Robot, motion: Motion) -> Candidate | None:
    """An effect of all driven joints, scaled so that their expected motions are about equal."""
    effect = candidate.effect
    sizes = law_sizes(robot.with_effects(effect), motion, effect.names)
    largest = max(sizes.values())
    both = zip(effect.joints, effect.names, strict=True)
    driven = tuple(joint for joint, name in both if sizes[name] > MIN_DRIVEN_SHARE * largest)
    if len(driven) < 2:
        return None
    fewer = replace(effect, joints=driven, coefficients=())
    return Candidate(fewer, np.diag([sizes[n] ** -2.0 for n in fewer.names]), alike=True)


def _still(motion: Motion) -> Iterator[str]:
    """Notes on joints that move too little for errors over their position, and on a payload that stays."""
    for joint in sorted(set(range(motion.q.shape[1])) - set(moved_joints(motion))):
        yield f"joint {joint + 1} hardly moved, so errors that depend on its position were not tried"
    if motion.payload is not None and len(motion) and np.ptp(motion.payload) == 0.0:
        yield "the payload is the same in all rows, so it can't be separated from the arm's own weight"


def carriers(effects: Sequence[AbstractEffect]) -> tuple[AbstractEffect, ...]:
    """The smallest subset of effects whose coefficients cover those of all."""
    kept: list[AbstractEffect] = []
    covered: set[str] = set()
    for effect in sorted(effects, key=lambda e: -len(e.names)):
        if not set(effect.names) <= covered:
            kept.append(effect)
            covered |= set(effect.names)
    return tuple(kept)


def candidate_columns(
    problem: Problem,
    x: Float[np.ndarray, " p"],
    effects: Sequence[AbstractEffect],
    *,
    loaded: Sequence[AbstractEffect] = (),
) -> Iterator[tuple[RowBlock, Columns]]:
    """Whitened columns of some effects, block by block.

    Args:
        problem: Problem with the effects accepted so far.
        effects: Effects without common coefficients; K coefficients in all.
        loaded: Fitted effects of load; masses, centres and gravity act through each of them.

    Yields:
        A block of the problem, and the derivative of its residual components in coefficients, then in all of
        the problem's `inertia_tolerance` through each of `loaded`. Columns of events are plain.
    """

    def columns(arm: tuple[RowBlock, Robot, Motion]) -> Columns:
        block, robot, motion = arm
        places, varying = acting(problem, block)
        poses, twists, laws = _twists(robot, motion, effects, loaded, varying, block.observation.link)
        part = block.observation.linearise(poses, block.unknown(x))
        shown = problem.whiten(block, part.by_twist) @ twists
        plain: list[tuple[np.ndarray, np.ndarray]] = []
        products: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        start = 0
        for k, (where, law) in enumerate(laws):
            if k >= len(effects):  # entries of this block's session among those of all sessions
                session, law = law, np.zeros((*law.shape[:2], len(problem.inertia_tolerance)))
                law[:, :, [index[problem.names[place]] for place in places]] = session
            mine = np.arange(start, start := start + law.shape[2])
            if k < len(effects) and effects[k].is_event:
                plain.append((mine, shown[:, :, where] @ law))
            else:
                products.append((where, mine, law))
        return Columns.of(shown, plain, products)

    index = {name: k for k, name in enumerate(problem.inertia_tolerance)}
    yield from zip(problem.blocks, in_order(columns, tuple(_arms(problem, x))), strict=True)


def acting(problem: Problem, block: RowBlock) -> tuple[np.ndarray, np.ndarray]:
    """Indices in x, and columns of `load_regressor`, of what acts on a block's rows through loads only."""
    if block.deflected is None:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    places = np.concatenate([block.deflected.inertia, block.deflected.gravity])
    alone = np.array([problem.parameters[place].is_inertia for place in places], bool)
    return places[alone], block.deflected.varying[alone]


def _arms(problem: Problem, x: np.ndarray) -> Iterator[tuple[RowBlock, Robot, Motion]]:
    """The arm at x with the frames of each block, and the block's rows."""
    arm, motion = problem.frames.placed(problem.robot_at(x), problem.data.sessions), Motion.of(problem.data)
    for block in problem.blocks:
        mine = motion.take(block.rows) if block.deflected is None else block.deflected.motion
        yield block, arm.in_session(block.session), mine


def _twists(
    robot: Robot, motion: Motion, effects, loaded, varying: np.ndarray, link: int | None
) -> tuple[Float[np.ndarray, "rows 4 4"], Float[np.ndarray, "rows 6 e"], list[tuple[np.ndarray, np.ndarray]]]:
    """Poses of an arm with its effects, twists of the tool, or of a link from 1, per element moved by further
    effects, and for each of these, and of `loaded` by what is `varying` as in `load_regressor`, its elements
    and its law."""
    deflected = deflect(robot, motion)
    offered = {name for e in effects for name in e.names}
    others = (e for e in robot.effects if not offered & set(e.names))
    wide = revised(robot, effects=(*effects, *others))
    chain = wide.chain
    shift = np.zeros((len(motion), len(chain.elements)))
    shift[:, chain.indices([e.name for e in robot.chain.elements])] = deflected.shift
    needed = any(e.loads for e in effects)
    wrenches = known_wrenches(robot, motion, deflected.shift) if needed else NO_WRENCHES
    moved = [chain.indices(e.elements(chain)) for e in (*effects, *loaded)]
    union = np.unique(np.concatenate([*moved, np.zeros(0, np.int64)]))
    view = watched(wide, link)
    poses, twists = view.turned(*chains.twists(chain, motion.q, union, shift=shift, part=view.part))
    laws = [e.law(chain, motion, wrenches) for e in effects]
    if loaded:
        known = load_regressor(robot, motion, varying, shift=deflected.shift)
        for effect in loaded:
            loads = effect.components(chain)
            laws.append(effect.slope(chain, motion, wrenches) @ known[:, loads[:, 0], loads[:, 1]])
    return poses, twists, [(np.searchsorted(union, m), law) for m, law in zip(moved, laws, strict=True)]


def known_wrenches(robot: Robot, motion: Motion, shift: np.ndarray = chains.NO_SHIFT) -> np.ndarray:
    """Through every joint, from masses or else from measured torques; empty if neither is known."""
    if robot.has_masses:
        return motion_wrenches(robot, motion, shift=shift)
    if motion.torque is None:
        return NO_WRENCHES
    measured = np.full((*motion.q.shape, 6), np.nan)
    measured[:, np.arange(robot.dof), own_axis(robot)] = motion.torque
    return measured

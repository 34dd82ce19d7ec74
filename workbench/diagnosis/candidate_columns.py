"""Candidate columns: derivatives of every residual component with respect to effect coefficients.

An effect's column is the sum of its elements' twists times its law, seen by the block's observation and
whitened; the moments are those of the arm as it is bent by what was accepted. Of the total derivative the
part that bends the moments once more is left out: it is of second order, and refits do not use these columns.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.law import NO_WRENCHES
from workbench.arm.kinematics.observed_link import watched
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import deflect
from workbench.arm.statics.wrenches import inertia_regressor, masses, motion_wrenches, own_axis
from workbench.base.threads import in_order
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import Block


def carriers(effects: Sequence[AbstractEffect]) -> tuple[AbstractEffect, ...]:
    """The fewest of some effects whose coefficients cover those of all of them."""
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
    weighed: Sequence[AbstractEffect] = (),
) -> Iterator[tuple[Block, Float[np.ndarray, "m k"]]]:
    """Whitened columns of some effects, block by block.

    Args:
        problem: Its arm carries what was accepted so far.
        x: Its answer.
        effects: Without common coefficients; K of these in all.
        weighed: Fitted effects of load; masses and centres act through each of them.

    Yields:
        A block of the problem, and the derivative of its residual components in coefficients, then in masses
        and centres through each of `weighed`.
    """

    def columns(arm: tuple[Block, Robot, Motion]) -> np.ndarray:
        block, robot, motion = arm
        if not effects:
            return np.zeros((block.stop - block.start, 0))
        found = effect_twists(robot, motion, effects, weighed=weighed, link=block.observation.link)
        return _seen(problem, x, block, *found)

    yield from zip(problem.blocks, in_order(columns, tuple(_arms(problem, x))), strict=True)


def _arms(problem: Problem, x: np.ndarray) -> Iterator[tuple[Block, Robot, Motion]]:
    """The arm at x with the frames of every block, and the block's rows."""
    arm, motion = problem.frames.placed(problem.robot_at(x), problem.data.sessions), Motion.of(problem.data)
    for block in problem.blocks:
        yield block, arm.in_session(block.session), motion.take(block.rows)


def _seen(problem: Problem, x: np.ndarray, block: Block, poses: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Twists as the block's observation sees them, whitened."""
    part = block.observation.see(poses, problem.unknown(block, x))
    seen = problem.whiten(block, part.by_twist) @ twists
    return seen.reshape(-1, seen.shape[-1])


def effect_twists(
    robot: Robot,
    motion: Motion,
    effects: Sequence[AbstractEffect],
    *,
    weighed: Sequence[AbstractEffect] = (),
    link: int | None = None,
) -> tuple[Float[np.ndarray, "rows 4 4"], Float[np.ndarray, "rows 6 k"]]:
    """Poses of an arm with the effects that it has, and the tool's twist per coefficient of further ones.

    Args:
        effects: Further ones.
        weighed: Effects of load, sized, through which the twists per mass and centre are wanted too.
        link: The moving link, from 1, that is watched from a level frame in place of the tool.
    """
    bent = deflect(robot, motion)
    offered = {name for e in effects for name in e.names}
    wide = robot.with_effects(*effects, *(e for e in robot.effects if not offered & set(e.names)))
    chain = wide.chain
    shift = np.zeros((len(motion), len(chain.elements)))
    shift[:, chain.indices([e.name for e in robot.chain.elements])] = bent.shift
    loaded = any(e.loads for e in effects)
    wrenches = known_wrenches(robot, motion, bent.shift) if loaded else NO_WRENCHES
    moved = {e: chain.indices(e.elements(chain)) for e in (*effects, *weighed)}
    union, where = np.unique(np.concatenate(list(moved.values())), return_inverse=True)
    view = watched(wide, link)
    poses, twists = view.turned(*chains.twists(chain, motion.q, union, shift=shift, part=view.part))
    known = inertia_regressor(robot, motion, masses(robot), shift=bent.shift) if weighed else NO_WRENCHES
    parts, start = [], 0
    for k, (effect, places) in enumerate(moved.items()):
        mine = twists[:, :, where[start : start + len(places)]]
        if k < len(effects):
            law = effect.law(chain, motion, wrenches)
        else:
            loads = effect.components(chain)
            law = effect.slope(chain, motion, wrenches) @ known[:, loads[:, 0], loads[:, 1]]
        parts.append(mine @ law)
        start += len(places)
    return poses, np.concatenate(parts, axis=2)


def known_wrenches(robot: Robot, motion: Motion, shift: np.ndarray = chains.NO_SHIFT) -> np.ndarray:
    """Through every joint, from masses or else from measured torques; empty where neither is known."""
    if robot.has_masses:
        return motion_wrenches(robot, motion, shift=shift)
    if motion.torque is None:
        return NO_WRENCHES
    measured = np.full((*motion.q.shape, 6), np.nan)
    measured[:, np.arange(robot.dof), own_axis(robot)] = motion.torque
    return measured

"""Gravity sag: a joint deflects under the weight that it carries, with unknown masses.

The moment about joint j's axis u is linear in masses and first moments of the links after it. Its compliance
c times these are the unknowns; d is the direction of gravity, seen from the robot's base:

    Δv = Σ_t c_t (d × u) · w_t,      c_t = c g × (first moment or mass of term t)

    3x, 3y, 3z    w = R e_x …       R the frame after the drive of joint 3; c_t [rad]
    4m            w = a q_4         everything that prismatic joint 4 moves along its axis a; c_t [rad/m]
    payload       w = m (p_e − p_j) from the joint to the tool, m the payload of the row; c_t [rad/(kg m)]

Masses at fixed places of a link, including those of later links, only add to its first moments; the part
along a joint's own axis is equivalent to one of the link before it. The two first moments across each axis,
and a mass for each prismatic joint, are therefore sufficient for any masses (`terms_of`).

R, a, p_e and p_j are those of the undeflected arm: the change of sag by sag is of second order.

Source: Gautier, Khalil, Direct calculation of minimum set of inertial parameters of serial robots, IEEE
Trans. Robot. Autom. 6(3), 1990; here gravity alone.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from jaxtyping import Float, Int

from workbench.arm import chain as chains
from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Wrenches, across_axes, turns
from workbench.arm.effects.effect import (
    AbstractEffect,
    Candidate,
    Growth,
    Law,
    has_complete_payload,
    has_complete_torques,
)
from workbench.arm.frame import BASE
from workbench.arm.motion import Motion
from workbench.base.types import JointRows
from workbench.report.numbers import readable

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

MAX_FREE_TERMS = 2
"""Number of terms up to which they are free; more are shrunk together."""
PAYLOAD = "payload"
TERM = re.compile(r"([1-9][0-9]*)([xyzm])")
NO_CONSTANTS = np.zeros(0, np.int64)
NO_CONSTANTS.setflags(write=False)


def terms_of(chain: Chain, joint: int, *, payload: bool = False) -> str:
    """The smallest set of terms that covers the effect of any masses on a joint.

    Args:
        joint: Column of q, counted from 0.
        payload: Whether the payload varies between rows.
    """
    terms = []
    for k in range(joint, chain.dof):
        letters = ["xyz"[i] for i in sorted(across_axes(chain, k))] if turns(chain, k) else ["m"]
        terms += [f"{k + 1}{letter}" for letter in letters]
    return " ".join([*terms, PAYLOAD] if payload else terms)


@final
@dataclass(frozen=True)
class GravitySag(AbstractEffect):
    """One joint; one coefficient per term.

    Args:
        terms: Its terms, as in the module, separated by spaces; links count from 1.
        gravity: Direction of gravity in the robot's base frame.
    """

    terms: str = ""
    gravity: tuple[float, ...] = (0.0, 0.0, -1.0)
    name = "gravity-sag"
    does = "{} gives under the weight it carries", "{} give under the weight they carry"
    credible = (0.05, 0.0)
    """For each weight after the joint, as for `joint-compliance`."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"joint{j + 1}.sag_{term}" for j in self.joints for term in self.terms.split())

    def units(self, chain: Chain) -> tuple[str, ...]:
        units = {"m": "rad/m", "d": "rad/(kg*m)"}
        return tuple(units.get(term[-1], "rad") for term in self._terms)

    def bounds(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> tuple[float, ...]:
        """No weight deflects a joint further where its axis is level; about the vertical it feels none."""
        return tuple(min(b, self.credible[0]) for b in super().bounds(chain, motion, wrenches))

    def doubt(self, motion: Motion) -> str | None:
        """It is tried if masses are unknown, and then compliance of bearings and links can't be tried
        instead."""
        return "without masses, compliance of bearings and links can't be tried as an alternative"

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        _, _, pull, _, levers, *_ = _rigid(self, chain, motion)
        return np.einsum("ri,rti->rt", pull, levers)[:, None]

    def growth(
        self, chain: Chain, motion: Motion, wrenches: Wrenches, constants: Int[np.ndarray, " p"]
    ) -> Growth:
        """Elements after the joint move lever arms; those before it rotate all of them, and the axis.

        The latter is a rotation of gravity by the opposite angle (known masses:
        `arm/statics/load_derivatives.py`).
        """
        sizes = np.array(self.coefficients)
        axis, point, pull, links, levers, axes, points, payload = _rigid(self, chain, motion, constants)
        points = points - point[:, None]
        turning = (chain.axes[constants] < 3)[:, None]
        load = (payload * sizes[[t == PAYLOAD for t in self._terms]].sum())[:, None, None]
        carried = np.einsum("pt,rti->rpi", constants[:, None] <= links, levers * sizes[:, None])
        moved = np.where(turning, np.cross(axes, carried - load * points), load * axes)
        whole = np.einsum("rti,t->ri", levers, sizes)
        turned = np.where(turning, np.cross(self._down, np.cross(whole, axis))[:, None] * axes, 0.0)
        behind = np.einsum("ri,rpi->rp", pull, moved)
        grown = np.where(constants >= chain.driven[self.joints[0]], behind, turned.sum(2))
        return np.where(constants >= _base_size(chain), grown, 0.0)[:, None]

    def mistake(self, chain: Chain) -> str | None:
        if len(self.joints) != 1 or not turns(chain, self.joints[0]):
            return f"takes one revolute joint, not {[j + 1 for j in self.joints]}"
        if len(self.gravity) != 3 or not np.any(self.gravity) or not np.isfinite(self.gravity).all():
            return f"needs the direction of gravity as three numbers, not {list(self.gravity)}"
        if len(set(self._terms)) != len(self._terms) or not self._terms:
            return f"needs different terms, such as '{terms_of(chain, self.joints[0])}', not '{self.terms}'"
        wrong = [term for term in self._terms if not self._fits(chain, term)]
        if wrong:
            known = terms_of(chain, self.joints[0], payload=True)
            return f"of joint {self.joints[0] + 1} has no term '{wrong[0]}'; use '{known}', or some of these"
        return None

    def sentence(self, chain: Chain, motion: Motion) -> str:
        largest = readable(float(np.abs(self.increments(chain, motion)).max(initial=0.0)), "rad")
        return f"{self.where} deflects under the weight it carries, by up to {largest}"

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        """At every revolute joint, if neither masses nor torques are known."""
        is_known = arm.has_masses or has_complete_torques(motion)
        if is_known or not has_complete_payload(motion) or not np.any(arm.gravity):
            return
        yield "gravity-sag was tried instead: compliance times weight, joint by joint"
        for effect in sags(arm, motion):
            many = len(effect.names) > MAX_FREE_TERMS
            yield Candidate(effect, np.eye(len(effect.names)) if many else None)
            if many:  # due to the next link only, indistinguishable from an eccentric if the axis is level
                yield Candidate(
                    replace(effect, terms=" ".join(effect.terms.split()[:MAX_FREE_TERMS]), coefficients=())
                )

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "GravitySag":
        terms = terms_of(arm.chain, joint)
        return cls((joint,), tuple(rng.uniform(-1.0, 1.0, len(terms.split()))), terms=terms)

    @property
    def _terms(self) -> list[str]:
        return self.terms.split()

    @property
    def _down(self) -> np.ndarray:
        return np.array(self.gravity) / np.linalg.norm(self.gravity)

    def _fits(self, chain: Chain, term: str) -> bool:
        """Whether the arm has such a term after the joint."""
        found = TERM.fullmatch(term)
        if found is None:
            return term == PAYLOAD
        link = int(found[1]) - 1
        return self.joints[0] <= link < chain.dof and (found[2] != "m" or not turns(chain, link))


def sags(arm: "Robot", motion: Motion) -> list[GravitySag]:
    """A sag of every revolute joint, due to its links and a varying payload; none without weight."""
    if not np.any(arm.gravity):
        return []
    down = tuple((arm.gravity / np.linalg.norm(arm.gravity)).tolist())
    load = motion.payload
    varies = load is not None and bool(np.isfinite(load).all() and np.ptp(load) > 0.0)
    turning = (j for j in range(arm.dof) if turns(arm.chain, j))
    return [GravitySag((j,), terms=terms_of(arm.chain, j, payload=varies), gravity=down) for j in turning]


def _rigid(
    effect: GravitySag, chain: Chain, motion: Motion, constants: Int[np.ndarray, " p"] = NO_CONSTANTS
) -> tuple[np.ndarray, ...]:
    """The undeflected arm in every row, from its base's frame.

    Returns:
        Axis of the joint (rows, 3), a point on it [m], d × u; the last element that moves each term (t,), w
        of each (rows, t, 3); axes of the constants' elements (rows, p, 3), points on these [m]; payload [kg].
    """
    joint, terms = int(chain.driven[effect.joints[0]]), effect._terms
    links = np.array([len(chain.elements) - 1 if t == PAYLOAD else chain.driven[_link(t)] for t in terms])
    at = _frames(chain, motion.q, np.concatenate([[joint], links, constants]))
    axis, point = at[:, 0, :3, chain.axes[joint] % 3], at[:, 0, :3, 3]
    payload = np.zeros(len(motion)) if motion.payload is None else motion.need("payload", effect.name)
    levers = np.empty((len(motion), len(terms), 3))
    for i, term in enumerate(terms):
        frame = at[:, 1 + i, :3]
        if term == PAYLOAD:
            levers[:, i] = payload[:, None] * (frame[:, :, 3] - point)
        elif term[-1] == "m":
            levers[:, i] = frame[:, :, chain.axes[links[i]] % 3] * motion.q[:, [_link(term)]]
        else:
            levers[:, i] = frame[:, :, "xyz".index(term[-1])]
    requested = at[:, 1 + len(terms) :, :3]
    axes = np.take_along_axis(requested, (chain.axes[constants] % 3)[None, :, None, None], axis=3)[..., 0]
    across = np.cross(effect._down, axis)
    return axis, point, across, links, levers, axes, requested[..., 3], payload


def _link(term: str) -> int:
    """Joint before the link of a term, counted from 0."""
    return int(term[:-1]) - 1


def _base_size(chain: Chain) -> int:
    """Number of elements of the base, whose gravity is given behind them."""
    return next(k for k, e in enumerate(chain.elements) if e.link != BASE)


def _frames(chain: Chain, q: JointRows, elements: Int[np.ndarray, " f"]) -> Float[np.ndarray, "rows f 4 4"]:
    """Frames behind some elements, from the frame behind the base; that frame itself for the base's own."""
    first = _base_size(chain)
    wanted, where = np.unique(np.maximum(elements, first - 1), return_inverse=True)
    return chains.frames(chain, q, wanted, first=first)[:, where]

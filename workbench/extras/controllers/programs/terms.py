"""Effects as terms of few kinds, which a program of a few lines adds up without this package.

    Δv_k = Σ_t term_t,      k the element that the term changes

Each effect with its coefficients is some terms; what they mean stands once for each kind in `standalone.py`
(and `standalone.h`). A test compares them with the law of every effect of the catalogue. An effect from
elsewhere registers how it is lowered:

    @terms_of.register
    def _(effect: GearSag, chain): return [Term(Kind.LINEAR, …)]
"""

from enum import IntEnum
from functools import singledispatch
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from workbench.arm.chain import Chain
from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.axes import across_components, own_components, turns
from workbench.arm.effects.backlash import Backlash
from workbench.arm.effects.bearing_compliance import BearingCompliance
from workbench.arm.effects.clearance_tilt import ClearanceTilt
from workbench.arm.effects.encoder_scale import EncoderScale
from workbench.arm.effects.gravity_sag import PAYLOAD, GravitySag
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.arm.effects.link_flexure import LinkFlexure
from workbench.arm.effects.local_joint_error import LocalJointError
from workbench.arm.effects.thermal_growth import ThermalGrowth
from workbench.arm.effects.valid_range import FADING_KNOTS, Learned
from workbench.arm.motion import Motion
from workbench.base.errors import OptionError

TURN = 2.0 * np.pi


class TermKind(IntEnum):
    """What a term adds; q the joints, W the wrenches, all by the numbers of `CodeTerm`."""

    LINEAR = 0  # a q_i
    HARMONIC = 1  # (a cos(c q_i) + b sin(c q_i)) fade(q_i)
    SPLINE = 2  # spline_j(q_i) fade(q_i), repeated every turn if c
    WARM = 3  # (T - b) (a + c q_i)
    DIRECTION = 4  # a sign(direction_i)
    SAG = 5  # a (d × u_i) · w_jk
    LOAD = 6  # a W_ij; loads from here on
    PLAY = 7  # a tanh(W_ij / b), a sign(W_ij) if b = 0
    TIP = 8  # a W_ij / |(W_ij, W_ik)|
    FLEX = 9  # a (cos(c + b q_i) W_ij + sin(c + b q_i) W_ik)


class CodeTerm(NamedTuple):
    """One term.

    Args:
        kind: What it adds.
        element: Element of the full chain that it changes.
        i: Joint.
        j: Component of its wrench, number of a spline, element of a link that weighs.
        k: A second component, or the axis of the link that weighs: 0–2; 3 what slides, 4 the payload.
        a: Size.
        b: See `TermKind`.
        c: See `TermKind`.
        low: From where it was learned [rad or m].
        high: To where.
        span: Over which it fades out beyond; 0 if it holds anywhere.
        direction: Of gravity.
        knots: Of a spline.
        cubics: Its polynomials, four numbers each, highest power first.
    """

    kind: TermKind
    element: int
    i: int = -1
    j: int = 0
    k: int = 0
    a: float = 0.0
    b: float = 0.0
    c: float = 0.0
    low: float = 0.0
    high: float = 0.0
    span: float = 0.0
    direction: tuple[float, ...] = (0.0, 0.0, 0.0)
    knots: tuple[float, ...] = ()
    cubics: tuple[tuple[float, ...], ...] = ()


@singledispatch
def terms_of(effect: AbstractEffect, chain: Chain) -> list[CodeTerm]:
    """The terms of an effect with its coefficients."""
    raise OptionError(
        f"a program can't hold the effect '{effect.name}'; register its terms "
        "(workbench.extras.controllers.programs.terms), or use `workbench compensate`",
        option="--for",
        found=effect.name,
    )


def _places(effect: AbstractEffect, chain: Chain) -> list[int]:
    return chain.indices(effect.elements(chain)).tolist()


def _loads(effect: AbstractEffect, chain: Chain, components: np.ndarray) -> list:
    """Element, joint and component of its wrench, and coefficient of each term."""
    each = np.repeat(effect.coefficients, len(components) // len(effect.coefficients)).tolist()
    return list(zip(_places(effect, chain), components.tolist(), each, strict=True))


def _faded(term: CodeTerm, learned: Learned | None) -> CodeTerm:
    if learned is None:
        return term
    return term._replace(low=learned.low, high=learned.high, span=FADING_KNOTS * learned.spacing)


@terms_of.register
def _(effect: JointCompliance, chain: Chain) -> list[CodeTerm]:
    rows = _loads(effect, chain, own_components(chain, effect.joints))
    return [CodeTerm(TermKind.LOAD, e, i, j, a=-c) for e, (i, j), c in rows]


@terms_of.register
def _(effect: Backlash, chain: Chain) -> list[CodeTerm]:
    rows = _loads(effect, chain, own_components(chain, effect.joints))
    if effect.by == "motion":
        return [CodeTerm(TermKind.DIRECTION, e, i, a=-c) for e, (i, _), c in rows]
    return [CodeTerm(TermKind.PLAY, e, i, j, a=-c, b=effect.width) for e, (i, j), c in rows]


@terms_of.register
def _(effect: BearingCompliance, chain: Chain) -> list[CodeTerm]:
    rows = _loads(effect, chain, across_components(chain, effect.joints))
    return [CodeTerm(TermKind.LOAD, e, i, j, a=-c) for e, (i, j), c in rows]


@terms_of.register
def _(effect: ClearanceTilt, chain: Chain) -> list[CodeTerm]:
    rows = _loads(effect, chain, across_components(chain, effect.joints))
    return [CodeTerm(TermKind.TIP, e, i, j, rows[k ^ 1][1][1], a=-c) for k, (e, (i, j), c) in enumerate(rows)]


@terms_of.register
def _(effect: LinkFlexure, chain: Chain) -> list[CodeTerm]:
    across = across_components(chain, effect.joints).tolist()
    out = []
    for place, (element, c) in enumerate(zip(_places(effect, chain), effect.coefficients, strict=True)):
        joint, first = across[place - place % 2]
        turning = turns(chain, joint)
        angle = float(chain.values[chain.driven[joint]]) if turning else 0.0
        quarter = 0.5 * np.pi * (place % 2)  # the second axis: cos → −sin, sin → cos
        second = across[place - place % 2 + 1][1]
        out.append(
            CodeTerm(TermKind.FLEX, element, joint, first, second, a=-c, b=float(turning), c=angle + quarter)
        )
    return out


@terms_of.register
def _(effect: JointHarmonic, chain: Chain) -> list[CodeTerm]:
    pairs = np.reshape(effect.coefficients, (len(effect.joints), -1, 2)).tolist()
    return [
        _faded(CodeTerm(TermKind.HARMONIC, e, i, a=cos, b=sin, c=float(order)), effect.learned)
        for e, i, own in zip(_places(effect, chain), effect.joints, pairs, strict=True)
        for order, (cos, sin) in zip(effect.orders, own, strict=True)
    ]


@terms_of.register
def _(effect: EncoderScale, chain: Chain) -> list[CodeTerm]:
    rows = zip(_places(effect, chain), effect.joints, effect.coefficients, strict=True)
    return [CodeTerm(TermKind.LINEAR, e, i, a=c) for e, i, c in rows]


@terms_of.register
def _(effect: JointCoupling, chain: Chain) -> list[CodeTerm]:
    return [CodeTerm(TermKind.LINEAR, _places(effect, chain)[0], effect.joints[1], a=effect.coefficients[0])]


@terms_of.register
def _(effect: ThermalGrowth, chain: Chain) -> list[CodeTerm]:
    warmer = Motion(np.zeros((1, chain.dof)), temperature=np.array([effect.reference + 1.0]))
    grown = effect.increments(chain, warmer)[0].tolist()  # at q = 0; a drive's travel comes on top
    c, drivers = effect.coefficients[0], chain.drivers
    return [
        CodeTerm(
            TermKind.WARM,
            e,
            max(int(drivers[e]), 0),
            a=a,
            b=effect.reference,
            c=c if drivers[e] >= 0 else 0.0,
        )
        for e, a in zip(_places(effect, chain), grown, strict=True)
    ]


@terms_of.register
def _(effect: LocalJointError, chain: Chain) -> list[CodeTerm]:
    x, y = np.array(effect.knots), np.array(effect.coefficients)
    if effect.periodic:
        x, y = np.append(x, x[0] + TURN), np.append(y, y[0])
    spline = CubicSpline(x, y, bc_type="periodic" if effect.periodic else "clamped")
    term = CodeTerm(
        TermKind.SPLINE,
        _places(effect, chain)[0],
        effect.joints[0],
        c=float(effect.periodic),
        knots=tuple(x.tolist()),
        cubics=tuple(tuple(row) for row in spline.c.T.tolist()),
    )
    return [_faded(term, effect.learned)]


@terms_of.register
def _(effect: GravitySag, chain: Chain) -> list[CodeTerm]:
    down = tuple((np.array(effect.gravity) / np.linalg.norm(effect.gravity)).tolist())
    element, joint = _places(effect, chain)[0], effect.joints[0]
    out = []
    for term, c in zip(effect.terms.split(), effect.coefficients, strict=True):
        link = -1 if term == PAYLOAD else int(term[:-1]) - 1
        axis = 4 if term == PAYLOAD else "xyzm".index(term[-1])
        out.append(CodeTerm(TermKind.SAG, element, joint, link, axis, a=c, direction=down))
    return out

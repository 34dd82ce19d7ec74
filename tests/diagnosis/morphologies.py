"""The arms that hide effects: what turns and slides in which order, with masses, reach and a tool of its own.

All are nominal; `arms.make` errs their constants. A SCARA's upright axes carry no moment, a gantry's upright
slide carries always the same force: such effects can't be seen, and `decide.py` keeps them from being drawn.
"""

from dataclasses import replace

import generator
import numpy as np
from generator import VirtualArm, columns, move, turn


def ranged(arm, degrees):
    """The arm with these limits either way [deg]."""
    return replace(arm, limits=np.deg2rad(np.array(degrees, float)))


def _tool(length, aside):
    return move("z", length) @ move("x", aside) @ turn("y", 0.4)


def _ur():
    arm = replace(generator.three_parallel(), tool=_tool(0.12, 0.06))
    coms = arm.coms.copy()
    coms[-1] = 0.01, 0.0, -0.02
    limits = [(-180, 180), (-180, 0), (-150, 150), (-180, 180), (-180, 180), (-180, 180)]
    return ranged(replace(arm, coms=coms), limits)


def _industrial():
    """A heavy 6R arm with an offset shoulder and a spherical wrist."""
    table = columns((0.52, 0, 0, 0.67, 0, 0.158), (0.26, 0.68, 0.035, 0, 0, 0), (-1, 0, -1, 1, -1, 0))
    coms = [(-0.1, 0.05, 0), (-0.35, 0, 0.1), (0, 0.02, 0.08), (0, 0.2, 0), (0, 0, 0.02), (0.01, 0, -0.03)]
    arm = VirtualArm(
        "dh",
        table,
        tool=_tool(0.2, 0.1),
        masses=np.array([60.0, 42.0, 28.0, 12.0, 6.0, 2.0]),
        coms=np.array(coms, float),
    )
    return ranged(arm, [(-170, 170), (-120, -10), (-40, 140), (-180, 180), (-115, 115), (-180, 180)])


def _scara():
    """Two upright axes, a slide that reaches down, and a turning quill."""
    table = columns((0.42, 0, 0, 0.03), (0.325, 0.275, 0, 0), (0, 2, 0, 0))
    limits = np.array([(-2.3, 2.3), (-2.5, 2.5), (0.0, 0.2), (-np.pi, np.pi)])
    return VirtualArm(
        "dh",
        table,
        tool=_tool(0.06, 0.05),
        limits=limits,
        slides=(False, False, True, False),
        masses=np.array([4.5, 3.5, 0.9, 0.4]),
        coms=np.array([(-0.15, 0, 0.02), (-0.13, 0, -0.03), (0, 0, -0.1), (0.01, 0, 0.02)]),
    )


def _gantry():
    """A bridge along y, a carriage along x, a slide that reaches down, and a wrist of three axes."""
    d, a, turns = (0, 0, 0, 0.1, 0, 0.12), (0, -1.3, 0.05, 0, 0, 0), (1, 1, 0, 0, 0, 0)
    table = columns(d, a, (-1, 1, 1, 0, 1, -1), theta=turns)
    limits = [(0.2, 1.2), (0.2, 1.2), (0, 0.6), (-np.pi, np.pi), (-1.9, 1.9), (-np.pi, np.pi)]
    coms = [(0, 0, 0.3), (0, 0.05, 0), (0, 0, -0.3), (0, 0.01, -0.04), (0, -0.05, 0.01), (0.01, 0, -0.03)]
    return VirtualArm(
        "craig",
        table,
        tool=_tool(0.1, 0.05),
        limits=np.array(limits),
        slides=(True, True, True, False, False, False),
        masses=np.array([22.0, 9.0, 5.0, 1.6, 1.1, 0.5]),
        coms=np.array(coms, float),
    )


ARMS = {
    "aria": lambda: replace(generator.aria(), tool=_tool(0.10, 0.05)),
    "three-parallel": _ur,
    "katana": generator.katana,
}
"""A 6R arm, a 6R arm with three parallel axes, and a 5R arm, all with masses."""
SIX = ("aria", "three-parallel", "industrial")
MORPHOLOGIES = ARMS | {
    "industrial": _industrial,
    "seven": lambda: replace(generator.seven(), tool=_tool(0.10, 0.05)),
    "scara": _scara,
    "gantry": _gantry,
}
"""These, another 6R arm, a redundant 7R arm, and two that slide."""

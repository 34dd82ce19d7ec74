"""The Denavit–Hartenberg family: each convention is an order of the five constants of a joint.

    hayati, dh           Rot(z, q+θ) Trans(z, d) Trans(x, a) Rot(x, α) Rot(y, β)      ARIA eq. (8)
    craig, craig-hayati  Rot(x, α) Rot(y, β) Trans(x, a) Rot(z, q+θ) Trans(z, d)      Katana (3.1), (3.2)
    three-rotation       Rot(x, α) Rot(y, β) Rot(z, q+θ) Trans(x, a) Trans(z, d), or with order = "zyx"
                         Rot(z, q+θ) Rot(y, β) Rot(x, α) Trans(x, a) Trans(z, d)      Katana (4.2)–(4.5)

Standard DH is Hayati with β = 0, and Craig's is Katana's (3.2) with β = 0, so each pair shares an order;
α and a of a Craig joint are those of index i−1. A new convention is one more order.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np

from workbench.arm.chain import Axis, Element
from workbench.arm.joint import JointKind
from workbench.base.arguments import Given, Reads
from workbench.base.errors import RobotError
from workbench.base.toml import MAX_NUMBER

CONSTANTS = ("theta", "d", "a", "alpha", "beta")
AXES = {"theta": Axis.RZ, "d": Axis.TZ, "a": Axis.TX, "alpha": Axis.RX, "beta": Axis.RY}
DISTAL = ("theta", "d", "a", "alpha", "beta")
PROXIMAL = ("alpha", "beta", "a", "theta", "d")
THREE_ROTATION = {"xyz": ("alpha", "beta", "theta", "a", "d"), "zyx": ("theta", "beta", "alpha", "a", "d")}
ORDERS = {"hayati": DISTAL, "dh": DISTAL, "craig": PROXIMAL, "craig-hayati": PROXIMAL}
PARALLEL = 1e-3
"""Axes that differ by less than this [rad] count as parallel, so that β replaces d."""


def _bounded(value: Any, given: Given) -> float:
    is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if not is_number or not abs(value) < MAX_NUMBER:
        raise ValueError
    return float(value)


def _counted(value: Any, given: Given) -> int:
    if type(value) is not int or value < 1:
        raise ValueError
    return value - 1


Bounded = Annotated[float, Reads("a finite number", _bounded)]
Column = Annotated[int, Reads("a joint's number from 1", _counted)]
"""A column of q, counted from 0 inside."""


@dataclass(frozen=True)
class JointEntry:
    """The geometry in one `[[joint]]` of a table: its kind, constants [rad, m], which of them may be
    identified, the order of a `three-rotation` joint, joints that it follows and their ratios, 1 if empty."""

    type: JointKind = JointKind.REVOLUTE
    theta: Bounded = 0.0
    d: Bounded = 0.0
    a: Bounded = 0.0
    alpha: Bounded = 0.0
    beta: Bounded = 0.0
    free: tuple[Literal["theta", "d", "a", "alpha", "beta"], ...] | None = None
    order: Literal["xyz", "zyx"] = "xyz"
    follows: tuple[Column, ...] = ()
    ratio: tuple[Bounded, ...] = ()

    @property
    def driven(self) -> str:
        """The constant that its axis moves; empty of a fixed joint, unless that turns by following others."""
        turns = self.type is JointKind.REVOLUTE or (self.type is JointKind.FIXED and self.follows)
        return "theta" if turns else "d" if self.type is JointKind.PRISMATIC else ""


def joint_names(kinds: Iterable[JointKind]) -> list[str]:
    """`joint1`, `joint2` … for moving joints, `fixed1` … for the others."""
    fixed = np.array([kind is JointKind.FIXED for kind in kinds], bool)
    counts = np.where(fixed, np.cumsum(fixed), np.cumsum(~fixed)).tolist()
    return [f"{'fixed' if still else 'joint'}{k}" for still, k in zip(fixed, counts, strict=True)]


def default_free(convention: str, entries: list[JointEntry]) -> list[tuple[str, ...]]:
    """Constants identified by default for each joint: θ, a, α and d, or β for d.

    Where two neighbouring moving axes are nominally parallel, their common normal jumps with the slightest
    tilt, and one d is redundant; Hayati's β takes its place (ARIA, remark below eq. 8), or joins the d that a
    prismatic axis moves.
    """
    orders_distal = ORDERS.get(convention) is DISTAL
    result: list[tuple[str, ...]] = []
    for i, entry in enumerate(entries):
        neighbour = i + 1 if orders_distal else i - 1
        pair = 0 <= neighbour < len(entries) and entry.driven and entries[neighbour].driven
        parallel = pair and abs(np.sin(entry.alpha)) < PARALLEL
        along = ("beta",) * bool(parallel) + ("d",) * (not parallel or entry.driven == "d")
        result.append(("theta", *along, "a", "alpha") if entry.driven else ())
    return result


def build_elements(convention: str, entries: list[JointEntry]) -> tuple[tuple[Element, ...], tuple[int, ...]]:
    """Elements of the arm, and the element after which each joint entry's link frame lies."""
    elements: list[Element] = []
    ends = []
    moving = 0
    defaults, names = default_free(convention, entries), joint_names(entry.type for entry in entries)
    for link, (entry, name, default) in enumerate(zip(entries, names, defaults, strict=True)):
        free = default if entry.free is None else entry.free
        ratios = entry.ratio or (1.0,) * len(entry.follows)
        if len(ratios) != len(entry.follows):
            counts = f"{len(entry.follows)} joints by {len(ratios)} ratios"
            raise RobotError(f"{name} follows {counts}; give one each")
        moves = entry.type is not JointKind.FIXED
        for constant in THREE_ROTATION[entry.order] if convention == "three-rotation" else ORDERS[convention]:
            elements.append(
                Element(
                    AXES[constant],
                    f"{name}.{constant}",
                    getattr(entry, constant),
                    joint=moving if moves and constant == entry.driven else None,
                    free=constant in free,
                    link=link,
                )
            )
            if constant == entry.driven:
                elements += followers(elements[-1], zip(entry.follows, ratios, strict=True))
        ends.append(len(elements) - 1)
        moving += moves
    return tuple(elements), tuple(ends)


def followers(drive: Element, follows: Iterable[tuple[int, float]]) -> list[Element]:
    """Elements on the axis of a driven one that follow other columns, each by a ratio."""
    name = drive.name.split(".")[0]
    return [
        Element(drive.axis, f"{name}.follows{column + 1}", follows=column, ratio=ratio, link=drive.link)
        for column, ratio in follows
    ]

"""The Denavit–Hartenberg family: each convention is an order of the five constants of a joint.

    hayati, dh           Rot(z, q+θ) Trans(z, d) Trans(x, a) Rot(x, α) Rot(y, β)      ARIA eq. (8)
    craig, craig-hayati  Rot(x, α) Rot(y, β) Trans(x, a) Rot(z, q+θ) Trans(z, d)      Katana (3.1), (3.2)
    three-rotation       Rot(x, α) Rot(y, β) Rot(z, q+θ) Trans(x, a) Trans(z, d), or with order = "zyx"
                         Rot(z, q+θ) Rot(y, β) Rot(x, α) Trans(x, a) Trans(z, d)      Katana (4.2)–(4.5)

Standard DH is Hayati with β = 0, and Craig's is Katana's (3.2) with β = 0, so each pair shares an order;
α and a of a Craig joint are those of index i−1. A new convention is one more order.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from workbench.arm.chain import Axis, Element
from workbench.arm.joint import JointKind
from workbench.base.errors import RobotError

CONSTANTS = ("theta", "d", "a", "alpha", "beta")
AXES = {"theta": Axis.RZ, "d": Axis.TZ, "a": Axis.TX, "alpha": Axis.RX, "beta": Axis.RY}
DISTAL = ("theta", "d", "a", "alpha", "beta")
PROXIMAL = ("alpha", "beta", "a", "theta", "d")
THREE_ROTATION = {"xyz": ("alpha", "beta", "theta", "a", "d"), "zyx": ("theta", "beta", "alpha", "a", "d")}
ORDERS = {"hayati": DISTAL, "dh": DISTAL, "craig": PROXIMAL, "craig-hayati": PROXIMAL}
PARALLEL = 1e-3
"""Axes that differ by less than this [rad] count as parallel, so that β replaces d."""


@dataclass(frozen=True)
class JointEntry:
    """One `[[joint]]` of a table: its kind, constants, which of them may be identified, and which joints it
    follows by what ratios."""

    kind: JointKind = JointKind.REVOLUTE
    constants: dict[str, float] = field(default_factory=dict)
    free: tuple[str, ...] | None = None
    order: str = "xyz"
    follows: tuple[tuple[int, float], ...] = ()


def joint_names(entries: list[JointEntry]) -> list[str]:
    """`joint1`, `joint2` … for moving joints, `fixed1` … for the others."""
    names, moving, fixed = [], 0, 0
    for entry in entries:
        if entry.kind is JointKind.FIXED:
            fixed += 1
            names.append(f"fixed{fixed}")
        else:
            moving += 1
            names.append(f"joint{moving}")
    return names


def default_free(convention: str, entries: list[JointEntry]) -> list[tuple[str, ...]]:
    """Constants identified by default for each joint: θ, a, α and d, or β for d.

    Where two neighbouring moving axes are nominally parallel, their common normal jumps with the slightest
    tilt, and one d is redundant; Hayati's β takes its place (ARIA, remark below eq. 8).
    """
    orders_distal = ORDERS.get(convention) is DISTAL
    result: list[tuple[str, ...]] = []
    for i, entry in enumerate(entries):
        neighbour = i + 1 if orders_distal else i - 1
        pair = 0 <= neighbour < len(entries) and all(
            entries[k].kind is JointKind.REVOLUTE for k in (i, neighbour)
        )
        twist = entry.constants.get("alpha", 0.0)
        parallel = pair and abs(np.sin(twist)) < PARALLEL
        if entry.kind is JointKind.FIXED:
            result.append(())
        else:
            result.append(("theta", "beta" if parallel else "d", "a", "alpha"))
    return result


def build_elements(convention: str, entries: list[JointEntry]) -> tuple[tuple[Element, ...], tuple[int, ...]]:
    """Elements of the arm, and the element after which each joint entry's link frame lies."""
    elements: list[Element] = []
    ends = []
    moving = 0
    defaults = default_free(convention, entries)
    for link, (entry, name, default) in enumerate(zip(entries, joint_names(entries), defaults, strict=True)):
        free = default if entry.free is None else entry.free
        if unknown := set(free) - set(CONSTANTS):
            raise RobotError(
                f"{name}: free names '{sorted(unknown)[0]}'; the constants are {', '.join(CONSTANTS)}",
                found=sorted(unknown)[0],
            )
        driven = {JointKind.REVOLUTE: "theta", JointKind.PRISMATIC: "d"}.get(entry.kind)
        order = THREE_ROTATION[entry.order] if convention == "three-rotation" else ORDERS[convention]
        for constant in order:
            elements.append(
                Element(
                    AXES[constant],
                    f"{name}.{constant}",
                    float(entry.constants.get(constant, 0.0)),
                    joint=moving if constant == driven else None,
                    free=constant in free,
                    link=link,
                )
            )
            if constant == driven:
                elements += followers(elements[-1], entry.follows)
        ends.append(len(elements) - 1)
        moving += driven is not None
    return tuple(elements), tuple(ends)


def followers(drive: Element, follows: Iterable[tuple[int, float]]) -> list[Element]:
    """Elements on the axis of a driven one that follow other columns, each by a ratio."""
    name = drive.name.split(".")[0]
    return [
        Element(drive.axis, f"{name}.follows{column + 1}", follows=column, ratio=ratio, link=drive.link)
        for column, ratio in follows
    ]

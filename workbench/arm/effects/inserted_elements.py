"""Elements that effects need beside those of the geometry: rotations of value 0 that they turn."""

from collections.abc import Iterable

from workbench.arm.chain import Axis, Chain, Element
from workbench.arm.effects.axes import Insertion, across_axes
from workbench.arm.effects.law import AbstractLaw


def drifting(base: tuple[Element, ...], effects: Iterable[AbstractLaw]) -> tuple[Element, ...]:
    """The base's elements with three rotations of value 0 behind them where an effect turns the base.

    They are not the base's own, whose values a calibration folds into the constant rotation before them.
    """
    if not any(e.insertion is Insertion.DRIFT for e in effects):
        return base
    names = ("roll", "pitch", "yaw")
    return (*base, *(Element(Axis(i), f"base.drift_{n}", link=base[0].link) for i, n in enumerate(names)))


def with_insertions(
    elements: tuple[Element, ...], dof: int, effects: Iterable[AbstractLaw]
) -> tuple[Element, ...]:
    """The elements with the rotations of value 0 that effects turn, beside the elements that joints drive."""
    wanted = {(e.insertion, j) for e in effects if e.insertion for j in e.joints}
    if not wanted:
        return elements
    chain = Chain(elements, dof)
    out: list[Element] = []
    for place, element in enumerate(elements):
        joint = element.joint
        if joint is None or place != chain.driven[joint]:
            out.append(element)
            continue
        sides: dict[Insertion, list[Element]] = {
            kind: [
                Element(Axis(axis), kind.element(joint, axis), link=element.link)
                for axis in (across_axes(chain, joint) if (kind, joint) in wanted else ())
            ]
            for kind in (Insertion.TILT, Insertion.BEND)
        }
        out += [*sides[Insertion.TILT], element, *sides[Insertion.BEND]]
    return tuple(out)

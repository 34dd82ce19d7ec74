"""Kinds of cases: what is hidden, what should be named, and what is given to the program."""

from collections.abc import Iterator
from dataclasses import dataclass

from generator import VirtualArm
from laws import NAMELESS, Effect, State

from workbench import Dataset, Robot
from workbench.arm.effects import EFFECTS, AbstractEffect


@dataclass(frozen=True)
class Named:
    """What a diagnosis should say.

    Args:
        name: Of the effect in the catalogue.
        joints: Counted from 0; empty where it concerns the whole arm.
        detail: Order of a harmonic; `moment` or `motion` for backlash; else None.
    """

    name: str
    joints: tuple[int, ...] = ()
    detail: int | str | None = None


@dataclass(frozen=True, eq=False)
class Case:
    """One arm with its measurements.

    Args:
        kind: Which of `CASES`.
        arm: Which of `MORPHOLOGIES`.
        seed: What it was drawn from.
        robot: The nominal arm as the program gets it; base and tool fixed or free.
        data: The measured rows as the program gets them.
        exact: Noise-free rows of the same arm and tool with their drivers, none of them misplaced, and none
            in which play hangs between its flanks.
        truth: What should be named; nothing where what is hidden has no name.
        allowed: What may be named beside it: true as well, but too small to be asked for, or nearly what a
            law without a name does.
        misseated: Rows that are off.
        hidden: The effects with their sizes.
        actual: The arm as made.
        state: Drivers of the measured rows.
        sigma: Noise per axis [m, rad].
        draws: How many draws it took until one could be told apart.
        seen: Whether the measured rows show it beside geometry and any rival, as they do under no conditions.
    """

    kind: str
    arm: str
    seed: int
    robot: Robot
    data: Dataset
    exact: Dataset
    truth: tuple[Named, ...]
    allowed: tuple[Named, ...]
    misseated: tuple[int, ...]
    hidden: tuple[Effect, ...]
    actual: VirtualArm
    state: State
    sigma: tuple[float, float]
    draws: int
    seen: bool = True


@dataclass(frozen=True)
class Kind:
    """A kind of case.

    Args:
        effects: Names and details of what is hidden; `any` stands for one of the catalogue.
        everywhere: Whether every joint has it.
        payload: Least and greatest mass at the tool [kg], if it is always there; equal for a tool's own.
        misseated: Whether some rows are off.
        apart: Whether effects are of different names and joints.
        leaning: How far gravity is from where the robot's file has it [deg].
    """

    effects: tuple[tuple[str, int | str | None], ...] = ()
    everywhere: bool = False
    payload: tuple[float, float] | None = None
    misseated: bool = False
    is_varied: bool = False
    leaning: float = 0.0

    @property
    def of_many(self) -> bool:
        """Whether several joints, all different, have one and the same effect."""
        return len(self.effects) > 1 and self.effects[0] != ANY and len(set(self.effects)) == 1

    @property
    def nameless(self) -> bool:
        """Whether the catalogue has no name for what is hidden."""
        return bool(self.effects) and all(name in NAMELESS for name, _ in self.effects)


ANY = ("any", None)
CASES = {
    "none": Kind(),
    "compliance": Kind((("joint-compliance", None),)),
    "compliance-all": Kind((("joint-compliance", None),), everywhere=True),
    "backlash-moment": Kind((("backlash", "moment"),)),
    "backlash-motion": Kind((("backlash", "motion"),)),
    "payload": Kind((("joint-compliance", None),), payload=(0.0, 2.0)),
    "tool-payload": Kind((("joint-compliance", None),), payload=(1.5, 1.5)),
    **{f"harmonic-{k}": Kind((("joint-harmonic", k),)) for k in (1, 2, 3, 4, 5)},
    "scale": Kind((("encoder-scale", None),)),
    "coupling": Kind((("joint-coupling", None),)),
    "thermal": Kind((("thermal-growth", None),)),
    "drift": Kind((("base-drift", None),)),
    "clearance": Kind((("clearance-tilt", None),)),
    "bearing": Kind((("bearing-compliance", None),)),
    "flexure": Kind((("link-flexure", None),)),
    "ripple": Kind((("joint-harmonic", "ripple"),)),
    "two": Kind((ANY, ANY)),
    "three": Kind((ANY, ANY, ANY), is_varied=True),
    "leaning-mount": Kind((("joint-compliance", None),), leaning=2.0),
    "dent": Kind((("dent", None),)),
    "kinked-gear": Kind((("kinked gear", None),)),
    "dragging-hose": Kind((("dragging hose", None),)),
    "wobbling-mount": Kind((("wobbling mount", None),)),
    "hardening-drive": Kind((("hardening drive", None),)),
    "belt-stretch": Kind((("belt stretch", None),)),
    "wind-up": Kind((("wind-up", None),)),
    "misseated": Kind(misseated=True),
    "misseated-any": Kind((ANY,), misseated=True),
    **{f"loose-{k}": Kind((("backlash", "moment"),) * k) for k in (3, 5, 4, 2)},
}
WITHOUT = ("none", "misseated")
"""Kinds without an effect."""
POOL = tuple(
    kind.effects[0]
    for name, kind in CASES.items()
    if kind.effects
    and kind.effects[0] != ANY
    and not kind.of_many
    and not kind.nameless
    and name not in ("ripple", "leaning-mount")
)
"""What `any` may be."""
NEARLY = {
    "wobbling mount": (("any", None),),
    "hardening drive": (("joint-compliance", None), ("backlash", "moment")),
    "belt stretch": (("joint-compliance", None),),
    "wind-up": (("backlash", "motion"),),
}
"""What may be blamed, beside a local joint error, in the joint that such a law bends; `any`: whatever."""


def required(effect: Effect) -> Named:
    """What a diagnosis should call an effect of the catalogue."""
    return Named(effect.name, effect.joints, effect.detail)


def permitted(kind: Kind, hidden: tuple[Effect, ...], dof: int) -> Iterator[Named]:
    """What is not wrong to say beside the truth: of many soft joints any, and what a law is nearly."""
    if kind.everywhere:
        yield from (Named(name, (j,), detail) for name, detail in kind.effects for j in range(dof))
    for effect in hidden if kind.nameless else ():
        for name, detail in (("local-joint-error", None), *NEARLY.get(effect.name, ())):
            yield Named(name, effect.joints, detail)


def stated(effect: Effect) -> AbstractEffect:
    """An effect of the catalogue as the package writes it."""
    settings = {"joint-harmonic": "order", "backlash": "by"}
    more = {settings[effect.name]: effect.detail} if effect.detail is not None else {}
    return EFFECTS[effect.name](effect.joints, effect.size, **more)

"""Kinds of cases: what is hidden, what should be named, and what is given to the program."""

from dataclasses import dataclass

from generator import VirtualArm
from laws import NAMELESS, Effect, State

from workbench.arm.effects import EFFECTS, AbstractEffect
from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset


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
        arm: Which of `ARMS`.
        seed: What it was drawn from.
        robot: The nominal arm as the program gets it; base and tool fixed or free.
        data: The measured rows as the program gets them.
        exact: Noise-free rows of the same arm and tool with their drivers, none of them misplaced, and none
            in which play hangs between its flanks.
        truth: What should be named.
        allowed: What may be named beside it: true as well, but too small to be asked for.
        misseated: Rows that are off.
        hidden: The effects with their sizes.
        actual: The arm as made.
        state: Drivers of the measured rows.
        sigma: Noise per axis [m, rad].
        draws: How many draws it took until one could be told apart.
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


@dataclass(frozen=True)
class Kind:
    """A kind of case.

    Args:
        effects: Names and details of what is hidden; `any` stands for one of the catalogue.
        everywhere: Whether every joint has it.
        payload: Least and greatest mass at the tool [kg], if it is always there; equal for a tool's own.
        misseated: Whether some rows are off.
    """

    effects: tuple[tuple[str, int | str | None], ...] = ()
    everywhere: bool = False
    payload: tuple[float, float] | None = None
    misseated: bool = False


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
    "two": Kind((ANY, ANY)),
    "dent": Kind((("dent", None),)),
    "kinked-gear": Kind((("kinked gear", None),)),
    "dragging-hose": Kind((("dragging hose", None),)),
    "wobbling-mount": Kind((("wobbling mount", None),)),
    "misseated": Kind(misseated=True),
    "misseated-any": Kind((ANY,), misseated=True),
}
POOL = tuple(
    kind.effects[0]
    for kind in CASES.values()
    if kind.effects and kind.effects[0] != ANY and kind.effects[0][0] not in NAMELESS
)
"""What `any` may be."""


def named(effect: Effect) -> Named:
    """What a diagnosis should call an effect."""
    if effect.name == "wobbling mount":
        return Named(effect.name, effect.joints)
    if effect.name in NAMELESS:
        return Named("local-joint-error", effect.joints)
    return Named(effect.name, effect.joints, effect.detail)


def told(effect: Effect) -> AbstractEffect:
    """An effect of the catalogue as the package writes it."""
    settings = {"joint-harmonic": "order", "backlash": "by"}
    more = {settings[effect.name]: effect.detail} if effect.detail is not None else {}
    return EFFECTS[effect.name](effect.joints, effect.size, **more)

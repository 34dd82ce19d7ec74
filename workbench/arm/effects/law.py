"""Laws of effects: increments of elementary values, linear in a few coefficients.

    v_k = driver_k(q) + p_k + Σ_e c_e · φ_e,k(state)

An effect names the elements k that it changes and gives its law φ of the state: joint positions, direction of
motion, time, temperature (`Motion`), and the wrenches through the joints. Nonlinear parameters (the order of
a harmonic, the knots of a spline) are fixed fields of its record.

Wrenches are those of `arm/statics/wrenches.py`: they hold the later link against its load. A joint deflects
with the load, so that load effects have a minus sign: a positive compliance sags.

Where the geometry lacks an element for an effect, rotations of value 0 are inserted.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from functools import cached_property
from math import isfinite
from typing import ClassVar, TypeVar

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.chain import Axis, Chain, Element
from workbench.arm.effects.axes import (
    Insertion,
    Wrenches,
    across_axes,
    across_components,
    driven_names,
    inserted_names,
    own_components,
    turns,
)
from workbench.arm.effects.valid_range import Learned
from workbench.arm.motion import Motion
from workbench.base.advice import beside
from workbench.base.errors import RobotError

Law = Float[np.ndarray, "rows e c"]
Slope = Float[np.ndarray, "rows e m"]
Growth = Float[np.ndarray, "rows e p"]
NO_WRENCHES = np.zeros((0, 0, 6))
NO_WRENCHES.setflags(write=False)
Same = TypeVar("Same", bound="AbstractLaw")
NO_COMPONENTS = np.zeros((0, 2), np.int64)
NO_COMPONENTS.setflags(write=False)


class Loads(IntEnum):
    """Which wrenches through the joints an effect depends on."""

    NONE = 0
    OWN = 1
    ALL = 2


@dataclass(frozen=True)
class AbstractLaw(ABC):
    """The physics of one effect: `name`, `law`, and whatever differs from the defaults.

    Args:
        joints: Columns of q that it belongs to, counted from 0; empty if it concerns the whole arm.
        coefficients: Sizes in the order of `names`, SI; zeros if left empty.
    """

    joints: tuple[int, ...] = ()
    coefficients: tuple[float, ...] = ()

    coefficient: ClassVar[str] = ""
    """Suffix after the joint in the name of a coefficient; the effect's name if empty."""
    unit: ClassVar[tuple[str, str]] = ("rad", "m")
    """Units of a coefficient for rotations and for translations; by default the increment's."""
    whole_arm: ClassVar[bool] = False
    """Whether it concerns the whole arm, and has no joints."""
    is_signed: ClassVar[bool] = False
    """Whether its coefficients may be negative although loads drive it."""
    maps_joint: ClassVar[bool] = False
    """Whether it is an error of each joint over that joint's own position; one per joint is enough."""

    def __post_init__(self):
        object.__setattr__(self, "joints", tuple(int(j) for j in self.joints))
        given = tuple(float(c) for c in self.coefficients)
        object.__setattr__(self, "coefficients", given or (0.0,) * len(self.names))

    @property
    @abstractmethod
    def name(self) -> str:
        """Its name in files, such as `joint-compliance`."""

    @abstractmethod
    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        """Increment of each element per unit of each coefficient [rad or m per unit].

        Args:
            chain: Base, arm and tool, with the constants in force.
            wrenches: Through every joint in its own axes [N, N m]; empty if `loads` requires none.
        """

    @property
    def loads(self) -> Loads:
        """Wrenches on which its law depends; none by default."""
        return Loads.NONE

    @property
    def needs(self) -> tuple[str, ...]:
        """Fields of `Motion` that its law requires, such as `temperature`; only q by default."""
        return ()

    @property
    def insertion(self) -> Insertion:
        """Rotations that its joints need in addition to the geometry's; none by default."""
        return Insertion.NONE

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of its C coefficients, such as `joint3.compliance`; usually one per joint, or per arm."""
        part = self.coefficient or self.name.replace("-", "_")
        return (f"arm.{part}",) if self.whole_arm else tuple(f"joint{j + 1}.{part}" for j in self.joints)

    def units(self, chain: Chain) -> tuple[str, ...]:
        each = len(self.names) // max(len(self.joints), 1)
        slides = (not (self.insertion or turns(chain, j)) for j in self.joints or (-1,))
        return tuple(self.unit[slide] for slide in slides for _ in range(each))

    def elements(self, chain: Chain) -> tuple[str, ...]:
        """Names of the E elements that it changes; usually its joints' own, or inserted ones."""
        if self.insertion:
            return inserted_names(chain, self.joints, self.insertion)
        return driven_names(chain, self.joints)

    def components(self, chain: Chain) -> Int[np.ndarray, "m 2"]:
        """Joint and index in [f; τ] of the M components required by `loads`."""
        if self.loads is Loads.NONE:
            return NO_COMPONENTS
        chosen = own_components if self.loads is Loads.OWN else across_components
        return chosen(chain, self.joints)

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        """Derivative of Σ c φ in its `components`, 0 by default and for steps; arguments as in `law`."""
        return np.zeros((len(motion), len(self.elements(chain)), len(self.components(chain))))

    def growth(
        self, chain: Chain, motion: Motion, wrenches: Wrenches, constants: Int[np.ndarray, " p"]
    ) -> Growth | None:
        """Derivative of Σ c φ in the constants of P elements at fixed wrenches; None if it is 0."""
        return None

    @property
    def learned(self) -> Learned | None:
        """Range where the map of its one joint was identified; it fades out beyond. None if it is valid
        anywhere."""
        return None

    def softened(self: Same, chain: Chain, wrenches: Wrenches) -> Same:
        """The same effect for a fit to rows with these wrenches; a step may get a width."""
        return self

    def mistake(self, chain: Chain) -> str | None:
        """What is wrong with its settings, as a clause after its name; None if nothing is."""
        return None

    @property
    def gives_way(self) -> bool:
        """Whether its coefficients can't be negative, as a joint can't deflect against its load."""
        return self.loads is not Loads.NONE and not self.is_signed

    def increments(
        self, chain: Chain, motion: Motion, wrenches: Wrenches = NO_WRENCHES
    ) -> Float[np.ndarray, "rows e"]:
        """Increment of each of its elements in every row [rad or m]; arguments as in `law`."""
        return self.law(chain, motion, wrenches) @ np.array(self.coefficients)

    def sized(self: Same, values: Mapping[str, float]) -> Same:
        """The same effect with the named coefficients replaced."""
        if values.keys().isdisjoint(self.names):
            return self
        pairs = zip(self.names, self.coefficients, strict=True)
        return replace(self, coefficients=tuple(float(values.get(name, c)) for name, c in pairs))

    def check(self, chain: Chain) -> None:
        """Refuse an effect that doesn't fit the arm.

        Raises:
            RobotError: no such joint, a wrong number of coefficients, or invalid settings.
        """
        dof = chain.dof
        wrong = self.mistake(chain)
        if self.whole_arm and self.joints:
            wrong = "concerns the whole arm; omit joints"
        elif self.joints and not (min(self.joints) >= 0 and max(self.joints) < dof):
            shown = next(j + 1 for j in self.joints if not 0 <= j < dof)
            wrong = f"names joint {shown}, but the arm's joints are 1 … {dof}"
        elif len(set(self.joints)) != len(self.joints):
            wrong = f"names a joint twice in {[j + 1 for j in self.joints]}"
        elif wrong is None and not self.names:
            wrong = "needs joints to act on"
        elif wrong is None and len(self.coefficients) != len(self.names):
            need = f"{len(self.names)} ({', '.join(self.names)})"
            wrong = f"has {len(self.coefficients)} coefficients but needs {need}"
        elif wrong is None and not all(map(isfinite, self.coefficients)):
            wrong = "has a coefficient that is not a finite number"
        if wrong:
            raise RobotError(f"effect '{self.name}' {wrong}")

    @classmethod
    def settings(cls) -> tuple[str, ...]:
        """Names of its fields other than joints and coefficients."""
        return tuple(f.name for f in fields(cls) if f.name not in ("joints", "coefficients"))


def check_together(effects: Iterable[AbstractLaw], chain: Chain, own: Collection[str]) -> None:
    """Refuse effects that don't fit an arm, and duplicate names among them and its `own` elements."""
    for effect in effects:
        effect.check(chain)
    coefficients = [name for e in effects for name in e.names]
    counts = Counter([*coefficients, *(e.name for e in chain.elements)])
    double = next((name for name, count in counts.items() if count > 1), None)
    if double in own:
        raise RobotError(f"the name '{double}' of an element is used by an effect; rename it")
    if double is not None:
        raise RobotError(f"'{double}' occurs twice among the effects; merge them", found=double)


@beside("notes on ranges of effects", ())
def extrapolation_notes(
    effects: Iterable[AbstractLaw],
    chain: Chain,
    q: Float[np.ndarray, "rows n"],
    rows: Int[np.ndarray, " rows"] | None = None,
) -> list[str]:
    """A sentence for every effect that fades out in some rows: joint, range, number of rows, farthest one.

    Args:
        effects: Effects that may be limited to part of a joint's range.
        q: Joint positions [rad or m].
        rows: Their numbers for people; counted from 0 if None.
    """
    notes = []
    for effect in effects:
        if effect.learned is None or not len(q):
            continue
        joint = effect.joints[0]
        beyond, row = effect.learned.farthest(q[:, joint])
        if beyond.any():
            unit, size = ("°", 180.0 / np.pi) if turns(chain, joint) else (" m", 1.0)
            low, high, farthest = (f"{v * size:.4g}{unit}" for v in (*effect.learned[:2], q[row, joint]))
            notes.append(
                f"{effect.name} of joint {joint + 1} was identified from {low} to {high}; "
                f"{int(beyond.sum())} of {len(q)} rows lie beyond (farthest: row "
                f"{row if rows is None else rows[row]} at {farthest}), where it fades to zero"
            )
    return notes


def turned(frame: tuple[Element, ...], effects: Iterable[AbstractLaw]) -> tuple[Element, ...]:
    """The elements of base or tool, followed by three rotations of value 0 if an effect needs them.

    They are not the frame's own rotations, which a calibration folds into the constant rotation before them.
    """
    kind = Insertion.DRIFT if frame[0].name.startswith("base.") else Insertion.SLIP
    if not any(e.insertion is kind for e in effects):
        return frame
    return (*frame, *(Element(Axis(i), name, link=frame[0].link) for i, name in enumerate(kind.frame[3:])))


def with_insertions(
    elements: tuple[Element, ...], dof: int, effects: Iterable[AbstractLaw]
) -> tuple[Element, ...]:
    """The elements with the inserted rotations of value 0 next to those driven by joints."""
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

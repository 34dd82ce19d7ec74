"""Effects: increments of elementary values, linear in a few coefficients, and everything else about them.

    v_k = driver_k(q) + p_k + Σ_e c_e · φ_e,k(state)

An effect names the elements k that it changes and gives its law φ of the state: joint positions, direction of
motion, time, temperature (`Motion`), and the wrenches through the joints. Nonlinear parameters (the order of
a harmonic, the knots of a spline) are fixed fields of its record. Where the geometry lacks an element for an
effect, rotations of value 0 are inserted. Wrenches are those of `arm/statics/wrenches.py`: they hold the
later link against its load. A joint deflects with the load, so that load effects have a minus sign: a
positive compliance sags.

An effect's file contains its law, candidates for a diagnosis (`offers`), a sentence for people, an example to
hide in a virtual arm, and flags. Other code uses this interface and never distinguishes effects by name.
Another package, or a notebook, adds its class in a record of parts (`workbench/parts.py`).
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, ClassVar, TypeVar

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.chain import Axis, Chain, Element
from workbench.arm.effects.axes import (
    PART_UNITS,
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
from workbench.arm.frame import revised
from workbench.arm.motion import Motion
from workbench.base.advice import beside
from workbench.base.errors import OptionError, RobotError
from workbench.base.wording import capital, joint_list
from workbench.report.numbers import readable

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

Law = Float[np.ndarray, "rows e c"]
Slope = Float[np.ndarray, "rows e m"]
Growth = Float[np.ndarray, "rows e p"]
NO_WRENCHES = np.zeros((0, 0, 6))
NO_WRENCHES.setflags(write=False)
Same = TypeVar("Same", bound="AbstractEffect")
STILL = float(np.deg2rad(1.0))
"""Range of a joint [rad, or m] below which its own errors are unobservable."""

UNCLEAR = "an error, clear at no single position,"
"""Phrase for a joint's error that is significant as a whole only."""
MIN_STATED_ERRORS = 3.0
"""Standard errors below which a size is not stated."""
MIN_LAW = 1e-9
"""Law sizes per unit coefficient [rad or m] below this count as zero."""


class Loads(IntEnum):
    """Which wrenches through the joints an effect depends on."""

    NONE = 0
    OWN = 1
    ALL = 2


@dataclass(frozen=True)
class AbstractEffect(ABC):
    """One effect: `name`, `law`, `sentence`, and whatever differs from the defaults.

    Args:
        joints: Columns of q that it belongs to, counted from 0; empty if it concerns the whole arm.
        coefficients: Sizes in the order of `names`, SI; zeros if left empty.
    """

    joints: tuple[int, ...] = ()
    coefficients: tuple[float, ...] = ()

    coefficient: ClassVar[str] = ""
    """Suffixes after the joint in the names of its coefficients; the effect's name if empty."""
    unit: ClassVar[tuple[str, str]] = ("rad", "m")
    """Units of a coefficient for rotations and for translations; by default the increment's."""
    whole_arm: ClassVar[bool] = False
    """Whether it concerns the whole arm, and has no joints."""
    maps_joint: ClassVar[bool] = False
    """Whether it is an error of each joint over that joint's own position; one per joint is enough."""
    moves_arm: ClassVar[bool] = True
    """Whether it moves the arm rather than the instrument."""
    is_event: ClassVar[bool] = False
    """Whether it happened during the measurements and is over: the present arm doesn't have it."""
    is_nameless: ClassVar[bool] = False
    """Whether it is an unnamed shape: it predicts, but a diagnosis never claims it as a cause."""
    has_play: ClassVar[bool] = False
    """Whether it jumps by its coefficients [rad or m] where its driver changes sign."""
    does: ClassVar[tuple[str, str]] = ("", "")
    """What it does at a joint `{}`, and at several, in a technician's words; if empty, its label."""
    handicap: ClassVar[float] = 0.0
    """Additional log evidence that a diagnosis requires of it [nat]."""
    of_many_joints: ClassVar[bool] = False
    """Whether joints usually have it together, so that a diagnosis tries it on all of them at once."""
    typical_size: ClassVar[float | None] = None
    """Typical maximum coefficient [SI]; None if a virtual arm should choose a clearly observable one."""
    usual_joint: ClassVar[int] = 1
    """Default joint of an example; from the last one if negative."""
    largest: ClassVar[float | None] = None
    """Largest credible coefficient [SI]; None where `credible` decides."""
    credible: ClassVar[tuple[float, float]] = (0.05, 0.01)
    """Largest plausible change of a rotation or translation over the rows [rad, m]. By default 3° and 10 mm:
    hobby servos and belts come near; an arm with larger errors is broken."""

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
        parts = (self.coefficient or self.name.replace("-", "_")).split()
        owners = ["arm"] if self.whole_arm else [f"joint{j + 1}" for j in self.joints]
        return tuple(f"{owner}.{part}" for owner in owners for part in parts)

    def units(self, chain: Chain) -> tuple[str, ...]:
        if self.insertion and not self.joints:
            return PART_UNITS[: len(self.names)]
        each = len(self.names) // max(len(self.joints), 1)
        slides = (not (self.insertion.of_joint or turns(chain, j)) for j in self.joints or (-1,))
        return tuple(self.unit[slide] for slide in slides for _ in range(each))

    def elements(self, chain: Chain) -> tuple[str, ...]:
        """Names of the E elements that it changes; usually its joints', inserted ones, or a frame's."""
        if self.insertion.of_joint:
            return inserted_names(chain, self.joints, self.insertion)
        if self.insertion and not self.joints:
            return self.insertion.frame[: len(self.names)]
        return driven_names(chain, self.joints)

    def components(self, chain: Chain) -> Int[np.ndarray, "m 2"]:
        """Joint and index in [f; τ] of the M components required by `loads`."""
        if self.loads is Loads.NONE:
            return np.zeros((0, 2), np.int64)
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
        """Whether its coefficients can't be negative, as a joint can't deflect against its load; by default
        where loads drive it."""
        return self.loads is not Loads.NONE

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
        return revised(self, coefficients=tuple(float(values.get(name, c)) for name, c in pairs))

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

    def sentence(self, chain: Chain, motion: Motion) -> str:
        """Description with its coefficients, in plain English with readable units, without a full stop."""
        variant = f" ({self.variant})" if self.variant and any(self.does) else ""
        return f"{capital(self.plain)}{variant}: {self.size(chain)}"

    def stated(self, chain: Chain, motion: Motion, covariance: Float[np.ndarray, "c c"]) -> str:
        """The sentence given the covariance of its coefficients [SI²]; usually significant sizes only."""
        clear = np.abs(self.coefficients) >= MIN_STATED_ERRORS * np.sqrt(np.diagonal(covariance))
        sizes = np.where(clear | ~clear.any(), self.coefficients, 0.0)
        return replace(self, coefficients=tuple(sizes.tolist())).sentence(chain, motion)

    @property
    def variant(self) -> str:
        """Distinguishes it from others of its name at its joints, such as `order 2`; empty by default."""
        return ""

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> "Iterator[Candidate | str]":
        """Candidates for an arm and its rows, and sentences on what can't be tried, and why.

        Usually the effect alone at every joint, or once for the whole arm, if its loads and drivers are
        known; at joints that moved, if it depends on their position.
        """
        if cls.whole_arm:
            return offered([cls()], arm, motion)
        one = cls((0,))
        joints = [*range(arm.dof)] if one.loads or one.needs else moved_joints(motion)
        many = cls.of_many_joints and len(joints) > 1
        together = [Candidate(cls(tuple(joints)), alike=True)] if many else []
        return offered([*(cls((j,)) for j in joints), *together], arm, motion)

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "AbstractEffect":
        """One to hide in a virtual arm, scaled to a maximum coefficient of about 1; usually all are 1.

        Args:
            joint: Counted from 0; ignored if it concerns the whole arm.
        """
        one = cls(() if cls.whole_arm else (joint,))
        return replace(one, coefficients=(1.0,) * len(one.names))

    def bounds(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> tuple[float, ...]:
        """Largest plausible size of each coefficient [SI]; usually what changes an element by `credible`.

        Loads below 1 N m or N count as this: they carry no information on a joint's stiffness. A diagnosis
        uses half the bound as prior standard deviation, and rejects larger coefficients.
        """
        if self.largest is not None:
            return (self.largest,) * len(self.names)
        law = np.nan_to_num(np.abs(self.law(chain, motion, wrenches))).max(0, initial=0.0)
        axes = [e.axis for e in chain.elements]
        slides = [axes[k] >= Axis.TX for k in chain.indices(self.elements(chain))]
        maximum = np.array(self.credible)[np.array(slides, int)]
        return tuple((maximum[:, None] / np.maximum(law, 1.0 if self.loads else MIN_LAW)).min(0).tolist())

    def doubt(self, motion: Motion) -> str | None:
        """Why no cause in these rows can be certain, as a clause; None, by default, if one can."""
        return None

    @property
    def flanked(self) -> tuple[int, ...]:
        """Joints at which it jumps with the sign of their own load, or by `Motion.flank`."""
        return self.joints if self.has_play and self.loads is Loads.OWN else ()

    @property
    def label(self) -> str:
        """Short, for tables: `joint-harmonic, joint 3, order 2`."""
        where = joint_list(self.joints) if self.joints else ""
        if not self.of_many_joints:
            where = where.replace(", ", " by ")
        return ", ".join(part for part in (self.name, where, self.variant) if part)

    @property
    def phrase(self) -> str:
        """Within a sentence: `joint-harmonic at joint 2, order 1`."""
        text = f"{self.name} at {self.where.lower()}" if self.joints else self.name
        return f"{text}, {self.variant}" if self.variant else text

    @property
    def plain(self) -> str:
        """In a technician's words: `joints 2 and 3 give under load`."""
        first, comma, last = (joint_list(self.joints) if self.joints else "").rpartition(", ")
        clause = self.does[len(self.joints) > 1].format(f"{first} and {last}" if comma else last)
        return clause or self.label

    @property
    def where(self) -> str:
        """`Joint 3` or `Joints 2, 3`, for the beginning of a sentence; `The arm` without joints."""
        return capital(joint_list(self.joints)) if self.joints else "The arm"

    def size(self, chain: Chain) -> str:
        """Its coefficient in readable units; of several the largest one of each unit."""
        units, largest = self.units(chain), dict[str, float]()
        for unit, value in sorted(zip(units, self.coefficients, strict=True), key=lambda pair: abs(pair[1])):
            largest[unit] = value
        shown = [readable(largest[u], u) for u in dict.fromkeys(units) if largest[u] or len(largest) == 1]
        return f"{'up to ' * (len(units) > 1)}{' and '.join(shown) or readable(0.0, units[0])}"

    def error_phrase(self, chain: Chain, motion: Motion, covariance: Float[np.ndarray, "c c"]) -> str:
        """Maximum error of its joint over the rows, without the part that the joint's zero may take if that
        is less, for laws without loads; where it is significant, `UNCLEAR` if it is nowhere."""
        law = self.law(chain, motion, NO_WRENCHES)[:, 0]
        largest, law = float(np.abs(law @ self.coefficients).max()), law - law.mean(0)
        error = np.abs(law @ self.coefficients)
        clear = error >= MIN_STATED_ERRORS * np.sqrt(np.maximum(((law @ covariance) * law).sum(1), 0.0))
        if not clear.any():
            return UNCLEAR
        return f"an error of up to {readable(min(largest, float(error[clear].max())), self.units(chain)[0])}"


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect for a diagnosis to try, with prior knowledge of its size.

    Args:
        effect: With zero coefficients.
        covariance: Of its coefficients up to a common factor, if they are many and shrunk together; None for
            a few free ones.
        alike: Whether that covariance follows from the sizes of its laws over the rows: all joints are
            expected to deflect about equally.
        tries: Number of times that were searched for it.
    """

    effect: AbstractEffect
    covariance: Float[np.ndarray, "k k"] | None = None
    alike: bool = False
    tries: int = 1

    @cached_property
    def names(self) -> tuple[str, ...]:
        return self.effect.names

    @property
    def shrunk(self) -> bool:
        """Whether its coefficients share a variance estimated from the data."""
        return self.covariance is not None

    @cached_property
    def root(self) -> Float[np.ndarray, "k k"]:
        """Lower root of the covariance."""
        assert self.covariance is not None, "only shrunk candidates have one"
        return np.linalg.cholesky(self.covariance)

    def only(self, places: Sequence[int]) -> "Candidate":
        """A candidate of several joints, reduced to those at the given places."""
        assert self.covariance is not None, "only shrunk candidates are of many joints"
        joints = tuple(self.effect.joints[i] for i in places)
        fewer = replace(self.effect, joints=joints, coefficients=())
        return Candidate(fewer, self.covariance[np.ix_(places, places)], alike=True)


def offered(
    effects: Iterable[AbstractEffect | Candidate], arm: "Robot", motion: Motion
) -> "Iterator[Candidate | str]":
    """Those effects whose loads and drivers are known in the rows, and why others can't be tried.

    Effects whose columns are absent are not mentioned.
    """
    for effect in effects:
        candidate = effect if isinstance(effect, Candidate) else Candidate(effect)
        if all(driver in motion.drivers for driver in candidate.effect.needs):
            yield _trouble(candidate.effect, arm, motion) or candidate


def _trouble(effect: AbstractEffect, arm: "Robot", motion: Motion) -> str | None:
    """Why an effect whose columns are present can't be tried, one sentence; None if it can."""
    for driver in effect.needs:
        values = motion.drivers[driver]
        if not np.isfinite(values).all():
            return f"the {driver} is missing in some rows, so its effects were not tried"
        if np.ptp(values) == 0.0:
            return f"the {driver} is the same in all rows, so its effects were not tried"
    if not effect.loads:
        return None
    if not has_complete_payload(motion):
        return "the payload is missing in some rows, so effects of load were not tried; fill the column"
    if arm.has_masses or (effect.loads is Loads.OWN and has_complete_torques(motion)):
        return None
    if has_complete_torques(motion):
        return "the robot has no masses: only effects of the measured joint torques were tried"
    return (
        "the robot has no masses, so compliance, backlash by load and clearance were not tried; add mass and "
        "com to its joints, or torque columns without gaps to the data"
    )


def has_complete_payload(motion: Motion) -> bool:
    """Whether no row lacks its payload; a table without that column has none."""
    return motion.payload is None or bool(np.isfinite(motion.payload).all())


def has_complete_torques(motion: Motion) -> bool:
    """Whether every row has all joint torques."""
    return motion.torque is not None and bool(np.isfinite(motion.torque).all())


def moved_joints(motion: Motion) -> list[int]:
    """Joints whose position varies enough over the rows to show an error over it."""
    return [j for j in range(motion.q.shape[1]) if np.ptp(motion.q[:, j]) > STILL]


def flattened(effects: Sequence[AbstractEffect | Sequence[AbstractEffect]]) -> tuple[AbstractEffect, ...]:
    """Effects given one by one or in lists."""
    flat = [e for part in effects for e in (part if isinstance(part, tuple | list) else (part,))]
    if (wrong := next((e for e in flat if not isinstance(e, AbstractEffect)), None)) is not None:
        text = f"effects must be such as JointCompliance((1,), (1e-5,)), got {wrong!r}"
        raise OptionError(text, option="effects", found=wrong)
    return tuple(flat)


def check_together(effects: Iterable[AbstractEffect], chain: Chain, own: Collection[str]) -> None:
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
    effects: Iterable[AbstractEffect],
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


def turned(frame: tuple[Element, ...], effects: Iterable[AbstractEffect]) -> tuple[Element, ...]:
    """The elements of base or tool, followed by three rotations of value 0 if an effect needs them.

    They are not the frame's own rotations, which a calibration folds into the constant rotation before them.
    """
    kind = Insertion.DRIFT if frame[0].name.startswith("base.") else Insertion.SLIP
    if not any(e.insertion is kind for e in effects):
        return frame
    return (*frame, *(Element(Axis(i), name, link=frame[0].link) for i, name in enumerate(kind.frame[3:])))


def with_insertions(
    elements: tuple[Element, ...], dof: int, effects: Iterable[AbstractEffect]
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

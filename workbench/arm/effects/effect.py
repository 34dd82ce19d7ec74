"""Effects: a law, and everything else about it.

An effect's file contains its law (`law.py`), candidates for a diagnosis (`offers`), a sentence for people,
its plot data (`plots.py`), an example to hide in a virtual arm, and flags. Other code uses this interface and
never distinguishes effects by name. Another package, or a notebook, adds its class in a record of parts
(`workbench/parts.py`).
"""

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from workbench.arm.chain import Axis, Chain
from workbench.arm.effects.axes import Wrenches
from workbench.arm.effects.law import NO_WRENCHES, AbstractLaw, Loads
from workbench.arm.motion import Motion
from workbench.base.errors import OptionError
from workbench.base.wording import capital, joint_list
from workbench.report.numbers import readable

STILL = float(np.deg2rad(1.0))
"""Range of a joint [rad, or m] below which its own errors are unobservable."""

UNCLEAR = "an error, clear at no single position,"
"""Phrase for a joint's error that is significant as a whole only."""
MIN_STATED_ERRORS = 3.0
"""Standard errors below which a size is not stated."""
MIN_LAW = 1e-9
"""Law sizes per unit coefficient [rad or m] below this count as zero."""


@runtime_checkable
class EffectArm(Protocol):
    """What an effect may require of its arm: a `Robot`, a module that imports this one."""

    @property
    def chain(self) -> Chain:
        """Base, arm and tool."""

    @property
    def dof(self) -> int:
        """Number of joints."""

    @property
    def gravity(self) -> Float[np.ndarray, "3"]:
        """Acceleration in the base frame [m/s²]."""

    @property
    def has_masses(self) -> bool:
        """Whether the moments of its joints can be computed."""

    @property
    def search_limits(self) -> Float[np.ndarray, "n 2"]:
        """Minimum and maximum position of every joint, all finite [rad or m]."""


@dataclass(frozen=True)
class AbstractEffect(AbstractLaw):
    """One effect with its coefficients: `name`, `law`, `sentence`, and optional properties."""

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
    surprise_size: ClassVar[float | None] = None
    """Typical maximum coefficient [SI] as the surprise of a virtual arm; None if it never is one."""
    credible: ClassVar[tuple[float, float]] = (0.05, 0.01)
    """Largest plausible change of a rotation or translation over the rows [rad, m]. By default 3° and 10 mm:
    hobby servos and belts come near; an arm with larger errors is broken."""

    @abstractmethod
    def sentence(self, chain: Chain, motion: Motion) -> str:
        """Description with its coefficients, in plain English with readable units, without a full stop."""

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
    def offers(cls, arm: EffectArm, motion: Motion) -> "Iterator[Candidate | str]":
        """Candidates for an arm and its rows, and sentences on what can't be tried, and why.

        Usually the effect alone at every joint, or once for the whole arm, if its loads and drivers are
        known; at joints that moved, if it depends on their position.
        """
        if cls.whole_arm:
            return offered([cls()], arm, motion)
        one = cls((0,))
        joints = range(arm.dof) if one.loads or one.needs else moved_joints(motion)
        return offered(separate_and_joint(cls((j,)) for j in joints), arm, motion)

    @classmethod
    def example(cls, arm: EffectArm, joint: int, rng: np.random.Generator) -> "AbstractEffect":
        """One to hide in a virtual arm, scaled to a maximum coefficient of about 1; usually all are 1.

        Args:
            joint: Counted from 0; ignored if it concerns the whole arm.
        """
        one = cls(() if cls.whole_arm else (joint,))
        return replace(one, coefficients=(1.0,) * len(one.names))

    def as_surprise(self, rng: np.random.Generator) -> "AbstractEffect":
        """The example for a virtual arm, if it has a `surprise_size`."""
        return self

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

    def caveat(self, motion: Motion) -> str | None:
        """A limitation due to the rows used for identification, one sentence; empty by default."""
        return None

    def doubt(self, motion: Motion) -> str | None:
        """Why no cause in these rows can be certain, as a clause; None, by default, if one can."""
        return None

    @property
    def flanked(self) -> tuple[int, ...]:
        """Joints at which it jumps with the sign of their own load, or by `Motion.flank`."""
        return ()

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
        """Its largest coefficient in readable units."""
        values = np.abs(self.coefficients)
        largest = int(np.argmax(values))
        return readable(float(values[largest]), self.units(chain)[largest])

    def error_phrase(
        self, chain: Chain, motion: Motion, covariance: Float[np.ndarray, "c c"] | None = None
    ) -> str:
        """Maximum deviation of its joint's error from the mean over the rows, for laws without loads; over
        those where it is significant, and `UNCLEAR` if there are none."""
        law = self.law(chain, motion, NO_WRENCHES)[:, 0]
        law = law - law.mean(0)
        error = np.abs(law @ self.coefficients)
        if covariance is not None:
            clear = error >= MIN_STATED_ERRORS * np.sqrt(np.maximum(((law @ covariance) * law).sum(1), 0.0))
            if not clear.any():
                return UNCLEAR
            error = error[clear]
        return f"an error of up to {readable(float(error.max()), self.units(chain)[0])}"


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

    @cached_property
    def _own(self) -> frozenset[str]:
        return frozenset(self.names)

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

    def excludes(self, other: "Candidate") -> bool:
        """Whether the two can't be in one model: one contains the other, or a part of it."""
        if not self._own.isdisjoint(other.names):
            return True
        both_map = self.effect.maps_joint and other.effect.maps_joint
        return both_map and self.effect.joints == other.effect.joints and (self.shrunk or other.shrunk)


def separate_and_joint(effects: Iterable[AbstractEffect]) -> list[AbstractEffect | Candidate]:
    """Effects of one joint each, and all of them as one effect if joints usually have it together."""
    alone = list(effects)
    if len(alone) < 2 or not alone[0].of_many_joints:
        return [*alone]
    together = replace(alone[0], joints=tuple(j for e in alone for j in e.joints), coefficients=())
    return [*alone, Candidate(together, alike=True)]


def offered(
    effects: Iterable[AbstractEffect | Candidate], arm: EffectArm, motion: Motion
) -> "Iterator[Candidate | str]":
    """Those effects whose loads and drivers are known in the rows, and why others can't be tried.

    Effects whose columns are absent are not mentioned.
    """
    for effect in effects:
        candidate = effect if isinstance(effect, Candidate) else Candidate(effect)
        if all(driver in motion.drivers for driver in candidate.effect.needs):
            yield _trouble(candidate.effect, arm, motion) or candidate


def _trouble(effect: AbstractEffect, arm: EffectArm, motion: Motion) -> str | None:
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

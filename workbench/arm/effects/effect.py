"""Effects: increments of elementary values that grow linearly with a few coefficients.

    v_k = driver_k(q) + p_k + Σ_e c_e · φ_e,k(state)

An effect names the elements k that it changes and gives its law φ of the state: joint positions, direction of
motion, time, temperature (`Motion`), and the wrenches through the joints. What is not linear (the order of a
harmonic, the knots of a spline) stands frozen in its record.

Wrenches are those of `arm/statics/wrenches.py`: what holds the later link against its load. A joint gives
way to the load, so that load effects carry a minus sign: a positive compliance sags.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.chain import Axis, Chain, Element
from workbench.arm.motion import Motion
from workbench.base.errors import DataError, RobotError

Law = Float[np.ndarray, "rows e c"]
Wrenches = Float[np.ndarray, "_ _ 6"]
BASE = -1
"""Link number of the base's elements."""
ROUNDING = 1e-9
"""How far outside its range a joint may be by rounding [rad or m]."""
NO_COMPONENTS = np.zeros((0, 2), np.int64)
NO_COMPONENTS.setflags(write=False)


class Loads(IntEnum):
    """What an effect must know of the wrenches through the joints."""

    NONE = 0
    OWN = 1
    ALL = 2


class Insertion(IntEnum):
    """Where an effect needs rotations that the geometry does not have.

    Two across a joint's axis, right before (tilt) or after (bend) what it drives; or three behind the base's.
    """

    NONE = 0
    TILT = 1
    BEND = 2
    DRIFT = 3

    def element(self, joint: int, axis: int) -> str:
        """Name of the rotation of a joint's tilt or bend about one axis."""
        return f"joint{joint + 1}.{self.name.lower()}_{'xyz'[axis]}"


@dataclass(frozen=True)
class AbstractEffect(ABC):
    """One effect with its coefficients.

    Args:
        joints: Columns of q that it belongs to, counted from 0; empty where it concerns the whole arm.
        coefficients: Sizes in the order of `names`, SI; zeros if left empty.
    """

    joints: tuple[int, ...] = ()
    coefficients: tuple[float, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "joints", tuple(int(j) for j in self.joints))
        given = tuple(float(c) for c in self.coefficients)
        object.__setattr__(self, "coefficients", given or (0.0,) * len(self.names))

    @property
    @abstractmethod
    def name(self) -> str:
        """Its name in files, such as `joint-compliance`."""

    @property
    @abstractmethod
    def loads(self) -> Loads:
        """What its law must know of the wrenches through the joints."""

    @property
    @abstractmethod
    def insertion(self) -> Insertion:
        """Rotations that its joints need beside those of the geometry."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of its C coefficients, such as `joint3.compliance`."""

    @property
    def gives_way(self) -> bool:
        """Whether its coefficients can't be negative, as nothing pushes back harder than it is loaded."""
        return self.loads is not Loads.NONE

    @abstractmethod
    def units(self, chain: Chain) -> tuple[str, ...]:
        """Their units."""

    @abstractmethod
    def elements(self, chain: Chain) -> tuple[str, ...]:
        """Names of the E elements that it changes."""

    @abstractmethod
    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        """Increment of each element per unit of each coefficient [rad or m per unit].

        Args:
            chain: Base, arm and tool, with the constants in force.
            motion: State of every row.
            wrenches: Through every joint in its own axes [N, N m]; empty where `loads` asks for none.
        """

    def components(self, chain: Chain) -> Int[np.ndarray, "m 2"]:
        """Joint and place in [f; τ] of what its law varies smoothly with; none by default."""
        return NO_COMPONENTS

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Float[np.ndarray, "rows e m"]:
        """Derivative of Σ c φ in the M wrench components of `components`; arguments as in `law`."""
        return np.zeros((len(motion), len(self.elements(chain)), len(self.components(chain))))

    def growth(
        self, chain: Chain, motion: Motion, wrenches: Wrenches, constants: Int[np.ndarray, " p"]
    ) -> Float[np.ndarray, "rows e p"] | None:
        """Derivative of Σ c φ in the constants of P elements at given wrenches; None where it is 0."""
        return None

    def sized(self, values: Mapping[str, float]) -> "AbstractEffect":
        """The same effect with those of its coefficients that are named."""
        if values.keys().isdisjoint(self.names):
            return self
        pairs = zip(self.names, self.coefficients, strict=True)
        return replace(self, coefficients=tuple(float(values.get(name, c)) for name, c in pairs))

    def ranges(self) -> dict[int, tuple[float, float]]:
        """Least and greatest position of the joints within which alone it is known; none by default."""
        return {}

    def mistake(self, chain: Chain) -> str | None:
        """What is wrong with its own settings, in a clause; None if nothing is."""
        return None

    def check(self, chain: Chain) -> None:
        """Refuse an effect that the arm can't carry.

        Raises:
            RobotError: no such joint, a wrong number of coefficients, or settings without sense.
        """
        dof = chain.dof
        wrong = self.mistake(chain)
        if self.joints and not (min(self.joints) >= 0 and max(self.joints) < dof):
            shown = next(j + 1 for j in self.joints if not 0 <= j < dof)
            wrong = f"names joint {shown}, but the arm's joints are 1 … {dof}"
        elif len(set(self.joints)) != len(self.joints):
            wrong = f"names a joint twice in {[j + 1 for j in self.joints]}"
        elif wrong is None and not self.names:
            wrong = "needs joints to act on"
        elif wrong is None and len(self.coefficients) != len(self.names):
            need = f"{len(self.names)} ({', '.join(self.names)})"
            wrong = f"has {len(self.coefficients)} coefficients but needs {need}"
        elif wrong is None and not np.isfinite(self.coefficients).all():
            wrong = "has a coefficient that is no finite number"
        if wrong:
            raise RobotError(f"effect '{self.name}' {wrong}")

    @classmethod
    def settings(cls) -> tuple[str, ...]:
        """Names of what its record holds beside joints and coefficients."""
        return tuple(f.name for f in fields(cls) if f.name not in ("joints", "coefficients"))


def check_ranges(
    effects: Iterable[AbstractEffect],
    chain: Chain,
    q: Float[np.ndarray, "rows n"],
    *,
    rows: Int[np.ndarray, " rows"] | None = None,
    source: str = "",
) -> None:
    """Refuse joint positions where an effect is not known.

    Args:
        effects: What may have been learned on part of a joint's range.
        chain: Of the arm.
        q: Joint positions [rad or m].
        rows: Their numbers for people; counted from 0 if None.
        source: Where they came from, for the message.

    Raises:
        DataError: names joint, position, range and row.
    """
    for effect in effects:
        for joint, (low, high) in effect.ranges().items():
            outside = ~((q[:, joint] >= low - ROUNDING) & (q[:, joint] <= high + ROUNDING))
            if outside.any():
                row = int(np.argmax(outside))
                unit, size = ("°", 180.0 / np.pi) if turns(chain, joint) else (" m", 1.0)
                least, greatest, found = (f"{v * size:.4g}{unit}" for v in (low, high, q[row, joint]))
                raise DataError(
                    f"{source}{': ' if source else ''}effect '{effect.name}' of joint {joint + 1} is known "
                    f"from {least} to {greatest} only, and row {row if rows is None else rows[row]} has the "
                    f"joint at {found}; stay within, or learn it there too"
                )


def driven(chain: Chain, joint: int) -> Element:
    """The (first) element that a joint drives."""
    return chain.elements[chain.driven[joint]]


def driven_names(chain: Chain, joints: Iterable[int]) -> tuple[str, ...]:
    """Names of the elements that some joints drive."""
    return tuple(driven(chain, j).name for j in joints)


def turns(chain: Chain, joint: int) -> bool:
    """Whether a joint is a rotation; True for one that the arm has not, which is said elsewhere."""
    return not 0 <= joint < chain.dof or Axis(driven(chain, joint).axis).turns


def own_components(chain: Chain, joints: Iterable[int]) -> Int[np.ndarray, "j 2"]:
    """Joint and component of [f; τ] of the moment about (force along) each joint's own axis."""
    return np.array([[j, (driven(chain, j).axis + 3) % 6] for j in joints], np.int64).reshape(-1, 2)


def own(chain: Chain, joints: Sequence[int], wrenches: Wrenches) -> Float[np.ndarray, "rows j"]:
    """Moment about (force along) each joint's own axis [N m or N]."""
    return wrenches[:, *own_components(chain, joints).T]


def across_axes(chain: Chain, joint: int) -> tuple[int, int]:
    """The two axes across a joint's own, in cyclic order: y, z for x; z, x for y; x, y for z."""
    axis = driven(chain, joint).axis % 3
    return (axis + 1) % 3, (axis + 2) % 3


def across_components(chain: Chain, joints: Iterable[int]) -> Int[np.ndarray, "j2 2"]:
    """Joint and component of [f; τ] of the two moments across each joint's axis."""
    found = [[j, 3 + axis] for j in joints for axis in across_axes(chain, j)]
    return np.array(found, np.int64).reshape(-1, 2)


def across(chain: Chain, joints: Sequence[int], wrenches: Wrenches) -> Float[np.ndarray, "rows j 2"]:
    """Moments across each joint's axis [N m]."""
    return wrenches[:, *across_components(chain, joints).T].reshape(len(wrenches), len(joints), 2)


def inserted_names(chain: Chain, joints: Iterable[int], kind: Insertion) -> tuple[str, ...]:
    """Names of the inserted rotations of some joints, two each."""
    return tuple(kind.element(j, axis) for j in joints for axis in across_axes(chain, j))


def diagonal(columns: Float[np.ndarray, "rows j"]) -> Float[np.ndarray, "rows j j"]:
    """A law whose every coefficient changes one element of its own."""
    return columns[:, :, None] * np.eye(columns.shape[1])


def paired(columns: Float[np.ndarray, "rows j 2"]) -> Float[np.ndarray, "rows e j"]:
    """A law whose every coefficient changes two elements of its own."""
    rows, joints, _ = columns.shape
    out = np.zeros((rows, joints, 2, joints))
    for j in range(joints):
        out[:, j, :, j] = columns[:, j]
    return out.reshape(rows, 2 * joints, joints)


def blocks(pairs: Float[np.ndarray, "rows j 2 2"]) -> Float[np.ndarray, "rows e e"]:
    """Matrices with a block of two rows and columns for every joint."""
    rows, joints = pairs.shape[:2]
    out = np.zeros((rows, joints, 2, joints, 2))
    for j in range(joints):
        out[:, j, :, j] = pairs[:, j]
    return out.reshape(rows, 2 * joints, 2 * joints)


def drifting(base: tuple[Element, ...], effects: Iterable[AbstractEffect]) -> tuple[Element, ...]:
    """The base's elements with three rotations of value 0 behind them where an effect turns the base.

    They are not the base's own, whose values a calibration folds into the constant rotation before them.
    """
    if not any(e.insertion is Insertion.DRIFT for e in effects):
        return base
    names = ("roll", "pitch", "yaw")
    return (*base, *(Element(Axis(i), f"base.drift_{n}", link=base[0].link) for i, n in enumerate(names)))


def with_insertions(
    elements: tuple[Element, ...], dof: int, effects: Iterable[AbstractEffect]
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

"""A serial arm as a chain of elementary transforms: the one formula of the package.

    T(q, p) = E_1(v_1) E_2(v_2) … E_K(v_K),        v_k = driver_k(q) + p_k + shift_k

Each E_k rotates about, or translates along, one axis of its own frame. Its driver is a joint or nothing,
p_k is a constant with a name, and shift_k is what effects add. The derivative has one rule: the column of
v_k is the twist of element k seen at the tool, [a × (p_e − p_k); a] for a rotation about the axis a
through p_k and [a; 0] for a translation along a, in base axes. For the Hayati chain these are ARIA eqs.
(13a–e), except that the α column takes the x axis before the β rotation, as eq. (8) demands and the
printed (13d) does not.

The loop over rows is compiled (numba) and takes eight rows at a time; everything else only describes the
chain.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any, no_type_check

import numpy as np
from jaxtyping import Float, Int
from numba import njit

from workbench.base.errors import OptionError
from workbench.base.types import Matrix4, frozen


class Axis(IntEnum):
    """The axis of an elementary transform, and whether it rotates about it or moves along it."""

    RX = 0
    RY = 1
    RZ = 2
    TX = 3
    TY = 4
    TZ = 5
    CONSTANT = 6

    @property
    def turns(self) -> bool:
        """True for a rotation."""
        return self <= Axis.RZ


@dataclass(frozen=True, eq=False)
class Element:
    """One elementary transform of a chain.

    Args:
        axis: Kind of transform.
        name: Name of its constant, such as `joint2.alpha`.
        value: The constant p [rad or m].
        joint: Column of q that drives it, or None.
        follows: Column of q that it follows in addition to the element driven by it (mimic), or None …
        ratio: … and its motion per unit of that joint.
        free: Whether its constant may be identified by default.
        link: Joint entry that it belongs to, counted from 0; -1 for the base, -2 for the tool.
        matrix: The transform of an `Axis.CONSTANT`, which has neither value nor driver.
    """

    axis: Axis
    name: str
    value: float = 0.0
    joint: int | None = None
    free: bool = False
    link: int = -1
    matrix: Matrix4 | None = None
    follows: int | None = None
    ratio: float = 1.0

    @property
    def unit(self) -> str:
        return "rad" if self.axis.turns else "m"


@dataclass(frozen=True, eq=False)
class Chain:
    """Elements in order from base to tool, compiled on first use.

    Args:
        elements: The elementary transforms.
        dof: Number of joint coordinates in q.
    """

    elements: tuple[Element, ...]
    dof: int

    @cached_property
    def axes(self) -> Int[np.ndarray, " k"]:
        """Axis code of every element."""
        return frozen(np.array([e.axis for e in self.elements], np.int64))

    @cached_property
    def drivers(self) -> Int[np.ndarray, " k"]:
        """Column of `positions` that drives each element; -1 for none."""
        out = np.array([-1 if e.joint is None else e.joint for e in self.elements], np.int64)
        out[self.followers] = self.dof + np.arange(len(self.followers))
        return frozen(out)

    @cached_property
    def followers(self) -> Int[np.ndarray, " f"]:
        """Elements that follow a joint in addition to the one driven by it."""
        return frozen(np.array([i for i, e in enumerate(self.elements) if e.follows is not None], np.int64))

    def positions(self, q: Float[np.ndarray, "_ n"]) -> Float[np.ndarray, "_ nf"]:
        """Joint coordinates, followed by those of mimic elements; rates likewise."""
        if not len(self.followers) or not len(q):
            return q
        mine = [self.elements[i] for i in self.followers]
        return np.concatenate([q, q[:, [e.follows for e in mine]] * [e.ratio for e in mine]], axis=1)

    @cached_property
    def driven(self) -> Int[np.ndarray, " n"]:
        """Element driven by each joint; 0 for a joint without one."""
        return frozen(np.array([int(np.argmax(self.drivers == j)) for j in range(self.dof)], np.int64))

    @cached_property
    def values(self) -> Float[np.ndarray, " k"]:
        """The current constants p: those of the elements, unless others were set."""
        return frozen(np.array([e.value for e in self.elements], float))

    @cached_property
    def turned(self) -> Float[np.ndarray, "3 k"]:
        """These constants, their sines and cosines."""
        return frozen(np.array([self.values, np.sin(self.values), np.cos(self.values)]))

    @cached_property
    def constants(self) -> Float[np.ndarray, "k 4 4"]:
        """Matrices of the constant elements; identities elsewhere."""
        out = np.tile(np.eye(4), (len(self.elements), 1, 1))
        for i, element in enumerate(self.elements):
            if element.matrix is not None:
                out[i] = element.matrix
        return frozen(out)

    @cached_property
    def index(self) -> dict[str, int]:
        """Position of each named element."""
        return {e.name: i for i, e in enumerate(self.elements)}

    def indices(self, names: Iterable[str]) -> Int[np.ndarray, " p"]:
        """Positions of the named elements.

        Raises:
            OptionError: there is none of a name.
        """
        try:
            return np.array([self.index[name] for name in names], np.int64)
        except KeyError as error:
            raise OptionError(
                f"no constant {error}; choose from {', '.join(self.index)}",
                option="names",
                found=error.args[0],
            ) from None

    def with_values(self, values: Float[np.ndarray, " k"]) -> "Chain":
        """The same chain with other constants; everything independent of them is shared."""
        other = Chain(self.elements, self.dof)
        shared = {
            name: getattr(self, name)
            for name in ("axes", "drivers", "driven", "followers", "constants", "index")
        }
        other.__dict__.update(shared, values=frozen(values.copy()))
        return other


ALONE: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
inner = njit(**ALONE)
"""Decorator of functions that only compiled ones call: no entry of their own is compiled."""
LANES = 8
"""Rows that the loop takes at a time."""
LARGEST = 1e15
"""Angles beyond this have no sine in double precision that means anything [rad]."""
FIRST, SECOND, THIRD = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
"""A quarter turn, in parts whose multiples are exact."""
SERIES = np.array([
    [1.58962301576546568060e-10, -1.13585365213876817300e-11],
    [-2.50507477628578072866e-8, 2.08757008419747316778e-9],
    [2.75573136213857245213e-6, -2.75573141792967388112e-7],
    [-1.98412698295895385996e-4, 2.48015872888517045348e-5],
    [8.33333333332211858878e-3, -1.38888888888730564116e-3],
    [-1.66666666666666307295e-1, 4.16666666666665929218e-2],
])  # fmt: skip
"""Factors of the sine's and the cosine's polynomials."""
NO_SHIFT = frozen(np.zeros((0, 0)))
WHOLE = slice(None)


def poses(
    chain: Chain,
    q: Float[np.ndarray, "rows n"],
    *,
    shift: Float[np.ndarray, "_ _"] = NO_SHIFT,
    part: slice = WHOLE,
) -> Float[np.ndarray, "rows 4 4"]:
    """Pose of the last frame in the first for every row.

    Args:
        chain: K elements.
        q: Joint coordinates [rad or m].
        shift: Increments by effects, per element; an empty array for none.
        part: Elements between the two frames, if not all.
    """
    return twists(chain, q, np.zeros(0, np.int64), shift=shift, part=part)[0]


def frames(
    chain: Chain,
    q: Float[np.ndarray, "rows n"],
    after: Int[np.ndarray, " f"],
    *,
    shift: Float[np.ndarray, "_ _"] = NO_SHIFT,
    first: int = 0,
) -> Float[np.ndarray, "rows f 4 4"]:
    """Poses of the frames after the given elements, in increasing order, in that right before the `first`."""
    out, ends = np.empty((len(q), len(after), 4, 4)), np.asarray(after, np.int64) + 1 - first
    part = slice(first, first + int(ends.max(initial=0)))
    _walk(chain, q, shift, part, np.full(part.stop - first, -1), ends, out, np.empty((len(q), 6, 0)))
    return out


def twists(
    chain: Chain,
    q: Float[np.ndarray, "rows n"],
    columns: Int[np.ndarray, " p"],
    *,
    shift: Float[np.ndarray, "_ _"] = NO_SHIFT,
    part: slice = WHOLE,
) -> tuple[Float[np.ndarray, "rows 4 4"], Float[np.ndarray, "rows 6 p"]]:
    """Poses, and the twist of the tool per unit of each chosen element.

    Args:
        chain: K elements.
        q: Joint coordinates [rad or m].
        columns: Elements to differentiate by.
        shift: Increments by effects, per element; an empty array for none.
        part: Elements between the first frame and the one observed instead of the tool, if not all; elements
            outside have no twist.

    Returns:
        Poses, and twists [v; w] at the tool's origin in base axes.
    """
    pose_out, twist_out = np.empty((len(q), 4, 4)), np.empty((len(q), 6, len(columns)))
    place = np.full(len(chain.elements), -1, np.int64)
    place[columns] = np.arange(len(columns))
    here = place[part]
    _walk(chain, q, shift, part, here, np.array([len(here)]), pose_out[:, None], twist_out)
    return pose_out, twist_out


def joint_twists(
    chain: Chain, q: Float[np.ndarray, "rows n"], *, part: slice = WHOLE
) -> tuple[Float[np.ndarray, "rows 4 4"], Float[np.ndarray, "rows 6 n"]]:
    """Poses, and the twist of the tool per joint coordinate, followers included; arguments as of `twists`."""
    found, columns = twists(chain, q, np.concatenate([chain.driven, chain.followers]), part=part)
    out = columns[:, :, : chain.dof]
    for k, place in enumerate(chain.followers, start=chain.dof):
        element = chain.elements[place]
        out[:, :, element.follows] += element.ratio * columns[:, :, k]
    return found, out


def _walk(
    chain: Chain,
    q: np.ndarray,
    shift: np.ndarray,
    part: slice,
    place: np.ndarray,
    ends: np.ndarray,
    pose_out: np.ndarray,
    twist_out: np.ndarray,
) -> None:
    """Fill poses after so many elements, and twists of those with a place; other arguments as of `twists`."""
    known = not len(shift) or shift.shape == (len(q), len(chain.elements))
    if q.shape[1:] != (chain.dof,) or not known or chain.values.shape != chain.axes.shape:
        raise IndexError("joints, constants or increments are not those of the chain")
    size, out = twist_out.shape[2], pose_out.reshape(len(q), len(ends), 16)
    out[:, :, 12:] = 0.0, 0.0, 0.0, 1.0
    given = chain.turned[:, part].copy(), frozen(chain.positions(q)), frozen(shift[:, part])
    matrices, room = chain.constants[part].reshape(-1, 16), np.empty((15, LANES))
    found = place, ends, out, twist_out, room, np.zeros((LANES, 9, size))
    _lanes(chain.axes[part], chain.drivers[part], *given, matrices, *found)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, no_rewrites=True)
@no_type_check
def _lanes(axes, drivers, fixed, positions, shift, constants, place, ends, out, twist, pose, lines):
    """Eight rows at a time: every inner loop runs over them and becomes SIMD. Each statement and each array
    takes its time to compile, an element of a tuple (`.shape[0]`) as much as a small function.

    Args:
        fixed: Values of all elements, their sines and cosines.
        place: Column of each element's twist; -1 for none.
        ends: Numbers of elements before each frame of `out`, in increasing order.
        pose: Room for the transform up to an element, and below for this one's value, sine and cosine.
        lines: Room for each twist's point, its axis if it turns, its axis if it slides; 0 before.

    Source of the sines: S. Moshier, Cephes (1989), sin.c: rest of a quarter turn in three parts, polynomials
    to 1 ulp. Numpy takes them one by one, five times as long.
    """
    rows, count, size = len(out), len(axes), lines.size // (9 * LANES)
    for start in range(0, rows, LANES):
        for i in range(12):
            for n in range(LANES):
                pose[i, n] = 1.0 if i % 5 == 0 else 0.0
        frame = 0
        for k in range(count + 1):
            while frame < len(ends) and ends[frame] == k:
                for n in range(min(LANES, rows - start)):
                    for i in range(12):
                        out[start + n, frame, i] = pose[i, n]
                frame += 1
            if k == count:
                break
            axis, column = axes[k], place[k]
            if column >= 0:
                turns = 1.0 if axis < 3 else 0.0
                for i in range(3):
                    for n in range(LANES):
                        along = pose[4 * i + axis % 3, n]
                        lines[n, i, column] = pose[4 * i + 3, n]
                        lines[n, i + 3, column] = turns * along
                        lines[n, i + 6, column] = along - turns * along
            if axis == 6:
                for i in range(0, 12, 4):
                    for n in range(LANES):
                        x, y, z = pose[i, n], pose[i + 1, n], pose[i + 2, n]
                        for j in range(4):
                            moved = x * constants[k, j] + y * constants[k, j + 4] + z * constants[k, j + 8]
                            pose[i + j, n] = moved + (pose[i + 3, n] if j == 3 else 0.0)
                continue
            driver, is_moved = drivers[k], False
            for i in range(3):
                for n in range(LANES):
                    pose[i + 12, n] = fixed[i, k]
            if driver >= 0 or len(shift) > 0:
                for n in range(LANES):
                    row = min(start + n, rows - 1)
                    pose[12, n] += positions[row, driver] if driver >= 0 else 0.0
                    pose[12, n] += shift[row, k] if len(shift) > 0 else 0.0
                    is_moved |= pose[12, n] != fixed[0, k]
            if is_moved and axis < 3:
                for n in range(LANES):
                    x = pose[12, n] if abs(pose[12, n]) < LARGEST else np.nan
                    turns = np.rint(x * 0.6366197723675814)
                    r = ((x - turns * FIRST) - turns * SECOND) - turns * THIRD
                    z, s, c = r * r, 0.0, 0.0
                    for i in range(6):
                        s, c = s * z + SERIES[i, 0], c * z + SERIES[i, 1]
                    s, c = r + r * z * s, 1.0 - 0.5 * z + z * z * c
                    quarter = turns - 4.0 * np.floor(0.25 * turns)
                    odd = quarter == 1.0 or quarter == 3.0
                    pose[13, n] = (c if odd else s) * (-1.0 if quarter > 1.5 else 1.0)
                    pose[14, n] = (s if odd else c) * (-1.0 if abs(quarter - 1.5) < 1.0 else 1.0)
            elif not is_moved and fixed[0, k] == 0.0:
                continue
            if axis < 3:
                a, b = (axis + 1) % 3, (axis + 2) % 3
                for i in range(0, 12, 4):
                    for n in range(LANES):
                        x, y = pose[i + a, n], pose[i + b, n]
                        pose[i + a, n] = x * pose[14, n] + y * pose[13, n]
                        pose[i + b, n] = y * pose[14, n] - x * pose[13, n]
            else:
                for i in range(0, 12, 4):
                    for n in range(LANES):
                        pose[i + 3, n] += pose[i + axis - 3, n] * pose[12, n]
        for n in range(min(LANES, rows - start)):
            for i in range(3):
                a, b = (i + 1) % 3, (i + 2) % 3
                y, z = pose[4 * a + 3, n], pose[4 * b + 3, n]
                for k in range(size):
                    arm = lines[n, a + 3, k] * (z - lines[n, b, k]) - lines[n, b + 3, k] * (
                        y - lines[n, a, k]
                    )
                    twist[start + n, i, k] = arm + lines[n, i + 6, k]
                    twist[start + n, i + 3, k] = lines[n, i + 3, k]

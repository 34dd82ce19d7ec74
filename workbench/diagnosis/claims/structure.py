"""Test whether residuals are noise: one test along every axis along which rows could agree.

Rows are sorted along an axis (order, an angle, a load, a temperature) or paired with their neighbours
(posture, place). Structure correlates residuals of neighbours:

    T = Σ r_i · r_j      over pairs of rows at most m places apart,   z = (T − mean) / deviation

with mean and deviation of T over permuted rows, and the largest z over a few m. Residuals r are tested in the
measuring frame, in the tool's (where a slip of the tool is constant), and along each joint's own column. All
tests together find structure in pure noise for at most `FALSE_ALARM_SHARE` of all arms (Bonferroni).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int
from scipy import special
from scipy.spatial import cKDTree

from workbench.arm.effects.axes import own, turns
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.statics.wrenches import motion_wrenches
from workbench.base.advice import beside
from workbench.base.wording import joint_list
from workbench.data.measuring_order import clock_of
from workbench.identification.fit import Fit
from workbench.identification.problem import Noise

FALSE_ALARM_SHARE = 0.01
"""Share of arms for which pure noise may be called structured, all axes together."""
LAGS = (1, 3, 8, 20)
"""Maximum lag between compared rows."""
NEAREST = (1, 4)
"""Number of neighbours with which a posture, or a place, is compared."""
PERMUTATIONS = 120
PERMUTED_AT_ONCE = 8000
"""Number of permuted rows processed together."""
MIN_ROWS = 20
"""Minimum number of rows."""
MIN_FREEDOM = 10.0
"""Minimum degrees of freedom."""
MAX_ROWS = 2000
"""Maximum number of rows, evenly spread over the measured ones."""
MIN_LOAD_VARIATION = 0.01
"""Variation below this share of the maximum load counts as constant."""
MIN_SKEW = 0.2
"""Minimum skewness assumed."""
ORDER_PARTS, MIN_STEP_SHARE = 10, 0.6
"""Number of parts of the order, and the share of their means' squares that a step must explain."""
PACES = np.geomspace(1.0 / 30.0, 0.4, 9)
"""Time constants of decays compared with a step, as shares of all rows."""
IN_ORDER = ORDER, TIME = "the order of the rows", "the time"
"""Names of the axis of measuring order."""


@dataclass(frozen=True, eq=False)
class StructureAxis:
    """One axis along which rows may agree.

    Args:
        name: Such as `the order of the rows`.
        label: Label of its values, with their unit.
        value: Value of every row; for postures and places, the order of the rows.
        view: Which residuals are compared: in the `frame`, in the `tool`'s axes, or of `joint 3`.
        p: Probability of such agreement by chance, for this test alone.
    """

    name: str
    label: str
    value: Float[np.ndarray, " rows"]
    view: str
    p: float

    @property
    def is_of_joint(self) -> bool:
        return self.view.startswith("joint")


@dataclass(frozen=True, eq=False)
class Structure:
    """Result of the tests.

    Args:
        axes: All tested axes, the least likely first.
        tests: Number of tests.
        row: Numbers of the tested rows.
        residual: Their residuals by label, in mm or mrad: in the first axis's view, or that of the order if
            no axis has structure.
        shown: That axis.
        step: Rows between which a step lies, if there is one in the order.
        where: Session of both, if there are several; empty otherwise.
        drifts: Drift of sessions from their first to their last row [mm], if there are several and the order
            has structure.
    """

    axes: tuple[StructureAxis, ...] = ()
    tests: int = 0
    row: Int[np.ndarray, " rows"] = field(default_factory=lambda: np.zeros(0, np.int64))
    residual: dict[str, np.ndarray] = field(default_factory=dict)
    shown: StructureAxis | None = None
    step: tuple[int, int] | None = None
    where: str = ""
    drifts: Mapping[str, float] = field(default_factory=dict)

    @property
    def found(self) -> tuple[StructureAxis, ...]:
        """Axes with significant structure, clearest first."""
        return tuple(a for a in self.axes if a.p * self.tests < FALSE_ALARM_SHARE)

    @property
    @beside("the text on structure", "has structure")
    def sentence(self) -> str:
        """Axis with structure, as a clause; empty if there is none."""
        if not self.found:
            return ""
        if self.step is not None:
            within = f" of session '{self.where}'" if self.where else ""
            return f"steps between rows {self.step[0]} and {self.step[1]}{within}"
        names = list(dict.fromkeys(a.name for a in self.found))[:2]
        drifts = ", ".join(f"session '{name}' drifts by {size:.2g} mm" for name, size in self.drifts.items())
        return f"follows {' and '.join(names)}{f' ({drifts})' if drifts else ''}"


def structure_of(fit: Fit, rng: np.random.Generator) -> Structure:
    """Test every axis that the rows have."""
    if fit.spare < MIN_FREEDOM or len(fit.problem.data) < MIN_ROWS:
        return Structure()
    left = RowRemainder(fit)
    nulls: dict[str, np.ndarray] = {}
    axes = []
    for name, label, value, view in _sorted_by(left):
        table = left.views[view]
        if view not in nulls:
            nulls[view] = np.concatenate([_agreement(mixed) for mixed in _permuted(table, rng)])
        found = _agreement(table[None, np.argsort(value, kind="stable")])[0]
        axes.append(StructureAxis(name, label, value, view, _chance(found, nulls[view])))
    for name, near in _neighbours(left):
        table = left.views["frame"]
        null = np.concatenate([_likeness(mixed, near) for mixed in _permuted(table, rng)])
        p = _chance(_likeness(table[None], near)[0], null)
        axes.append(StructureAxis(name, left.order.label, left.order.value, "frame", p))
    axes += [*_directions(left), *_sessions(left, rng)]
    axes.sort(key=lambda a: a.p)
    found = Structure(tuple(axes), len(axes))
    shown = (
        found.found[0]
        if found.found
        else next(a for a in axes if a.name == left.order.name and a.view == "frame")
    )
    in_order = bool(found.found) and shown.name in IN_ORDER
    step = left.step(shown) if in_order else None
    return Structure(
        tuple(axes),
        len(axes),
        left.row,
        left.physical(shown.view),
        shown,
        step,
        "" if step is None else left.session_of(step),
        left.drifts() if in_order else {},
    )


class RowRemainder:
    """Residuals of a fit, row by row, whitened as they were fitted or by another noise."""

    def __init__(self, fit: Fit, noise: Noise | None = None):
        data = fit.problem.data
        problem = fit.problem if noise is None else fit.problem.with_noise(noise)
        clock, is_timed = clock_of(data)
        order = np.argsort(clock, kind="stable")
        self._rows = rows = order[:: max(1, -(-len(data) // MAX_ROWS))]
        self.data, self.row = data.take(rows), np.asarray(data.row)[rows]
        self.arm = fit.arm
        self.motion = Motion.of(self.data)
        name, label = (TIME, "time [min]") if is_timed else (ORDER, "row of the file")
        self.order = StructureAxis(name, label, clock[rows] / (60.0 if is_timed else 1.0), "frame", 1.0)
        components = fit.problem.physical(fit.whitened)
        width = max(b.inverse_sigma.shape[1] for b in problem.blocks)
        shape = (len(data), width)
        self._size, sigma, by_joint = np.zeros(shape), np.ones(shape), np.zeros((*shape, data.joints))
        self._angles = np.zeros(shape, bool)
        for block in problem.blocks:
            here = slice(block.start, block.stop)
            own = block.inverse_sigma.shape[1]
            self._size[block.rows, :own] = components[here].reshape(-1, own)
            sigma[block.rows, :own] = problem.sigma[here].reshape(-1, own)
            by_joint[block.rows, :own] = block.by_joint
            self._angles[block.rows, :own] = block.observation.is_rotation
        self._size, self._angles = self._size[rows], self._angles[rows]
        white, slope = self._size / sigma[rows], by_joint[rows] / sigma[rows][:, :, None]
        self.views = {"frame": white}
        self._turn = tool_poses(self.arm.in_session(""), self.motion)[:, :3, :3]
        if width % 3 == 0:
            self.views["tool"] = self._turned(white)
        length = np.linalg.norm(slope, axis=1)
        along = (slope * white[:, :, None]).sum(1)
        safe = np.where(length > 0.0, length, 1.0)
        for j in range(data.joints):
            if (length[:, j] > 0.0).any():
                self.views[f"joint {j + 1}"] = (along[:, j] / safe[:, j])[:, None]
        self._apparent = along / safe**2

    def _turned(self, table: np.ndarray) -> np.ndarray:
        parts = table.reshape(len(table), -1, 3)
        return np.einsum("rba,rkb->rka", self._turn, parts).reshape(table.shape)

    def physical(self, view: str) -> dict[str, np.ndarray]:
        """Residuals in a view, in mm or mrad, by label."""
        if view.startswith("joint "):
            return {f"error of {view} [mrad]": 1e3 * self._apparent[:, int(view.split()[1]) - 1]}
        table = self._size if view == "frame" else self._turned(self._size)
        where = "measuring frame" if view == "frame" else "the tool's axes"
        names = [
            f"{'xyz'[k]} [{'mrad' if self._angles[:, k].any() else 'mm'}], {where}"
            for k in range(min(table.shape[1], 3))
        ]
        return {name: 1e3 * table[:, k] for k, name in enumerate(names)}

    def step(self, axis: StructureAxis) -> tuple[int, int] | None:
        """Rows between which residuals step, if a step explains them better than a line or a decay."""
        table = self.views[axis.view] - self.views[axis.view].mean(0)
        count = np.arange(1, len(table))
        by_step = (table.cumsum(0)[:-1] ** 2).sum(1) * len(table) / (count * (len(table) - count))
        done = np.linspace(0.0, 1.0, len(table))
        curves = np.stack([done, *(np.exp(-done / PACES[:, None]))])
        curves -= curves.mean(1, keepdims=True)
        by_curve = float((((curves @ table) ** 2).sum(1) / (curves**2).sum(1)).max())
        by_parts = sum(len(p) * float((p.mean(0) ** 2).sum()) for p in np.array_split(table, ORDER_PARTS))
        best = int(np.argmax(by_step))
        is_step = by_step[best] > max(by_curve, MIN_STEP_SHARE * by_parts)
        return (int(self.row[best]), int(self.row[best + 1])) if is_step else None

    def session_of(self, rows: tuple[int, int]) -> str:
        """The session of both rows, if there are several."""
        if self.data.session is None or len(self.data.sessions) < 2:
            return ""
        first, last = self.data.session[np.isin(self.row, rows)].tolist()
        return str(first) if first == last else ""

    def drifts(self) -> dict[str, float]:
        """Significant drift of positions within sessions, first row to last [mm]."""
        lengths, sessions, out = ~self._angles.any(0), self.data.sessions, {}
        for name in sessions if len(sessions) > 1 else ():
            mine = self.data.in_session(name)
            count, table = int(mine.sum()), self._size[mine][:, lengths]
            if count < MIN_ROWS or not lengths.any():
                continue
            time = np.linspace(-0.5, 0.5, count)
            slope = time @ table / (time @ time)
            rest = table - table.mean(0) - np.outer(time, slope)
            white = slope**2 * (time @ time) / (rest**2).sum(0) * (count - 2)
            chance = special.fdtrc(len(slope), len(slope) * (count - 2), white.mean())
            if chance * len(sessions) < FALSE_ALARM_SHARE:
                out[name] = 1e3 * float(np.linalg.norm(slope))
        return out


def _sorted_by(left: RowRemainder) -> Iterator[tuple[str, str, np.ndarray, str]]:
    """Axes along which rows can be sorted: name, label, values, view."""
    joints = [j for j in range(left.data.joints) if f"joint {j + 1}" in left.views]
    for view in left.views:
        yield left.order.name, left.order.label, left.order.value, view
    chain = left.arm.chain
    for j in joints:
        angle = turns(chain, j)
        q = left.data.q[:, j] * (np.rad2deg(1.0) if angle else 1e3)
        if np.ptp(q) > 0.0:
            name = f"the {'angle' if angle else 'position'} of {joint_list((j,))}"
            for view in ("frame", f"joint {j + 1}"):
                yield name, f"{name.removeprefix('the ')} [{'°' if angle else 'mm'}]", q, view
    if left.arm.has_masses:
        loads = own(chain, range(left.arm.dof), motion_wrenches(left.arm, left.motion))
        for j in joints:
            if np.ptp(loads[:, j]) > MIN_LOAD_VARIATION * max(np.abs(loads).max(), MIN_LOAD_VARIATION):
                yield f"the load of {joint_list((j,))}", "load [N·m or N]", loads[:, j], f"joint {j + 1}"
    warm = left.data.temperature
    if warm is not None and np.isfinite(warm).all() and np.ptp(warm) > 0.0:
        for view in ("frame", "tool"):
            if view in left.views:
                yield "the temperature", "temperature [°C]", warm, view


def _neighbours(left: RowRemainder) -> Iterator[tuple[str, np.ndarray]]:
    """Indices of the rows nearest to every row, in joint space and in Cartesian space."""
    q = left.data.q / np.maximum(np.ptp(left.data.q, axis=0), 1e-9)
    yield "the posture", neighbours(q, NEAREST[-1])
    if left.data.position is not None and np.isfinite(left.data.position).all():
        yield "the tool's position", neighbours(left.data.position, NEAREST[-1])


def neighbours(points: Float[np.ndarray, "rows d"], count: int) -> Int[np.ndarray, "rows k"]:
    """Rows nearest to every other row, nearest first; repeats, where points are repeated."""
    _, places = cKDTree(points).query(points, k=count + 1)
    mine = places == np.arange(len(points))[:, None]
    mine[~mine.any(1), count] = True
    return places[~mine].reshape(len(points), count)


def _directions(left: RowRemainder) -> Iterator[StructureAxis]:
    """The direction from which each joint came."""
    if left.data.direction is None:
        return
    for j in range(left.data.joints):
        sign, view = np.nan_to_num(left.data.direction[:, j]), f"joint {j + 1}"
        if view in left.views and (sign > 0).sum() >= MIN_ROWS / 4 <= (sign < 0).sum():
            error = left.views[view][:, 0]
            error = error - error.mean()
            z = abs(float(sign @ error)) / np.sqrt(max(float((sign * error) @ (sign * error)), 1e-300))
            name = f"the direction from which {joint_list((j,))} came"
            yield StructureAxis(
                name, "direction of the last motion", sign, view, float(2.0 * special.ndtr(-z))
            )


def _sessions(left: RowRemainder, rng: np.random.Generator) -> Iterator[StructureAxis]:
    """Session or group of every row."""
    for name, labels in (("the session", left.data.session), ("the group", left.data.group)):
        names, place = np.unique(np.zeros(0) if labels is None else labels, return_inverse=True)
        if not 1 < len(names) <= len(left.row) // 3:
            continue
        member = (place[:, None] == np.arange(len(names))).astype(float)
        member /= np.sqrt(member.sum(0))
        for view in ("frame", "tool"):
            if view in left.views:
                table = left.views[view] - left.views[view].mean(0)
                mixed = [table[rng.permutation(len(table))] for _ in range(PERMUTATIONS)]
                sums = np.array([[((member.T @ t) ** 2).sum()] for t in (table, *mixed)])
                yield StructureAxis(
                    name, name.removeprefix("the "), place.astype(float), view, _chance(sums[0], sums[1:])
                )


def _permuted(
    table: Float[np.ndarray, "rows w"], rng: np.random.Generator
) -> Iterator[Float[np.ndarray, "p rows w"]]:
    """The table with its rows permuted, several times at once to stay in the processor's cache."""
    some = max(1, PERMUTED_AT_ONCE // len(table))
    for start in range(0, PERMUTATIONS, some):
        times = range(start, min(start + some, PERMUTATIONS))
        yield np.stack([table[rng.permutation(len(table))] for _ in times])


def _agreement(tables: Float[np.ndarray, "p rows w"]) -> Float[np.ndarray, "p m"]:
    """Products of rows with later ones in sorted order."""
    running = np.pad(tables.cumsum(1), ((0, 0), (1, 0), (0, 0)))
    rows = tables.shape[1]
    here = np.arange(1, rows + 1)
    lags = [m for m in LAGS if m == 1 or 10 * m < rows]
    return np.stack(
        [((running[:, np.minimum(here + m, rows)] - running[:, here]) * tables).sum((1, 2)) for m in lags],
        axis=1,
    )


def _likeness(tables: Float[np.ndarray, "p rows w"], near: np.ndarray) -> Float[np.ndarray, "p m"]:
    """Products of rows with their neighbours."""
    return np.stack([(tables * tables[:, near[:, :k]].sum(2)).sum((1, 2)) for k in NEAREST], axis=1)


def _chance(found: Float[np.ndarray, " m"], mixed: Float[np.ndarray, "p m"]) -> float:
    """Probability of the largest statistic by chance, from those of permuted rows.

    Uses gamma distributions with their mean, variance and skewness: quadratic forms have a long tail.
    """
    mean, std = mixed.mean(0), np.maximum(mixed.std(0), 1e-300)
    skew = np.maximum((((mixed - mean) / std) ** 3).mean(0), MIN_SKEW)
    shape = 4.0 / skew**2
    place = np.maximum(shape + np.sqrt(shape) * (found - mean) / std, 0.0)
    return float(min(1.0, special.gammaincc(shape, place).min() * len(found)))

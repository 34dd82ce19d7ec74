"""Parameters as in the paper's Tables 3 and 4: one row a joint, one column a constant, θ d a α β.

Every cell has the nominal value, the identified one and its standard error; held constants are marked with
the paper's ∗, and so are those that can't be separated from others.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from workbench.identification.fit import Fit
from workbench.report.numbers import decimals_of, signed, standard_error

SYMBOLS = {"theta": "θ", "alpha": "α", "beta": "β"}
FAMILY = ("theta", "d", "a", "alpha", "beta")
"""Constants of the Denavit–Hartenberg conventions, in the paper's order."""


class ConstantStatus(StrEnum):
    """Status of a constant; the value is its mark in tables."""

    IDENTIFIED = ""
    HELD = "∗"
    SHARED = "†"
    UNSEEN = "‡"


LEGEND = {
    ConstantStatus.HELD: "held at its nominal value",
    ConstantStatus.SHARED: "can't be separated from others; kept as near to nominal as the rows allow",
    ConstantStatus.UNSEEN: "unobservable; left at its nominal value",
}


@dataclass(frozen=True)
class Cell:
    """One constant.

    Args:
        name: As in the result, such as `joint2.alpha`.
        unit: `rad` or `m`.
        value: Identified value; the nominal one if it was held.
        std: Standard error; None where there is none.
        state: Its status.
        is_expected: Whether the standard error is the prior's, as the rows add no information.
    """

    name: str
    unit: str
    nominal: float
    value: float
    std: float | None
    state: ConstantStatus
    is_expected: bool = False

    @property
    def readable_unit(self) -> str:
        """Unit for display."""
        return {"rad": "°", "m": "mm"}.get(self.unit, self.unit)

    @property
    def shown(self) -> tuple[str, str, str]:
        """Nominal value, deviation and standard error in that unit; empty where unknown.

        The deviation has as many decimals as its standard error.
        """
        scale = {"rad": float(np.rad2deg(1.0)), "m": 1e3}.get(self.unit, 1.0)
        nominal = signed(scale * self.nominal, 3)
        if self.state in (ConstantStatus.HELD, ConstantStatus.UNSEEN):
            return nominal, "", ""
        if self.std is None or self.is_expected:
            return nominal, f"{_plus(scale * (self.value - self.nominal), 3)}", ""
        decimals = decimals_of(scale * self.std)
        change = _plus(scale * (self.value - self.nominal), decimals)
        return nominal, change, standard_error(scale * self.std, decimals)


@dataclass(frozen=True)
class ParameterTable:
    """All constants of a fit.

    Args:
        columns: Names of the constants, `theta`, `d` …
        units: Unit of each column.
        rows: Name of every joint, and its cells; None where it has no such constant.
        others: Constants of frames and instruments, and those that belong to no joint.
    """

    columns: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Cell | None, ...]], ...]
    others: tuple[Cell, ...]

    @property
    def headings(self) -> tuple[str, ...]:
        """Column headings, such as `θ [°]`."""
        units = ("°" if unit == "rad" else "mm" for unit in self.units)
        return tuple(f"{SYMBOLS.get(c, c)} [{u}]" for c, u in zip(self.columns, units, strict=True))

    @property
    def marks(self) -> tuple[ConstantStatus, ...]:
        cells = [c for _, row in self.rows for c in row if c is not None] + list(self.others)
        return tuple(s for s in LEGEND if any(c.state is s for c in cells))


def unseen(fit: Fit) -> frozenset[str]:
    """Unobservable parameters: their standard error is meaningless."""
    return frozenset(c.names[0] for c in fit.unidentifiable if len(c.names) == 1)


def parameter_table(fit: Fit) -> ParameterTable:
    """The parameters of a fit, joint by joint."""
    shared = {n for c in fit.unidentifiable if len(c.names) > 1 for n in c.names}
    hidden, expected = unseen(fit), fit.only_expected
    cells: dict[str, Cell] = {}
    for e in fit.problem.robot.elements:
        if e.matrix is None:
            cells[e.name] = Cell(e.name, e.unit, e.value, e.value, None, ConstantStatus.HELD)
    for p, value, std in zip(fit.parameters, fit.x.tolist(), fit.std.tolist(), strict=True):
        state = ConstantStatus.SHARED if p.name in shared else ConstantStatus.IDENTIFIED
        if p.name in hidden:
            state, std = ConstantStatus.UNSEEN, None
        elif p.text in fit.idle:
            state, std = ConstantStatus.SHARED, None
        std = std if fit.is_assessed else None
        cells[p.name] = Cell(p.name, p.unit, p.nominal, value, std, state, p.name in expected)
    of_joints: dict[str, dict[str, Cell]] = {}
    others = []
    joints = {j.name for j in fit.problem.robot.joints}
    for name, cell in cells.items():
        owner, _, constant = name.rpartition(".")
        if owner in joints and name not in fit.problem.robot.coefficients:
            of_joints.setdefault(owner, {})[constant] = cell
        elif cell.state is not ConstantStatus.HELD:
            others.append(cell)
    columns = _columns(of_joints)
    units = tuple(next(row[c].unit for row in of_joints.values() if c in row) for c in columns)
    rows = tuple(
        (joint, tuple(row.get(c) for c in columns))
        for joint, row in of_joints.items()
        if any(c in row for c in columns)
        and (joint.startswith("joint") or any(cell.state is not ConstantStatus.HELD for cell in row.values()))
    )
    return ParameterTable(columns, units, rows, tuple(others))


def _plus(value: float, decimals: int) -> str:
    text = signed(value, decimals)
    return text if value < 0.0 or float(text) == 0.0 else f"+{text}"


def _columns(of_joints: dict[str, dict[str, Cell]]) -> tuple[str, ...]:
    """The convention's five constants, or whichever others were identified or are not 0."""
    present = [constant for row in of_joints.values() for constant in row]
    if any(c in FAMILY for c in present):
        return tuple(c for c in FAMILY if c in present)
    informative = {
        constant
        for row in of_joints.values()
        for constant, cell in row.items()
        if cell.state is not ConstantStatus.HELD or cell.nominal != 0.0
    }
    return tuple(c for c in dict.fromkeys(present) if c in informative)

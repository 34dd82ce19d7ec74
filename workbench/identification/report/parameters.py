"""Identified parameters: each with its unit, nominal value and standard error, for files and for people."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from workbench.identification.fit import Fit
from workbench.report.blocks import Block, ResultTable, Sentence, Tone
from workbench.report.numbers import decimals_of, readable_unit, signed, standard_error
from workbench.report.result_fields import ResultFields

UNITS = {"rad": (float(np.rad2deg(1.0)), "°"), "m": (1e3, "mm")}
"""Factor and name of the units in which people read constants; coefficients of effects have their own."""
UNINFORMATIVE_RATIO = 0.8
"""Ratio of a standard error to the prior's above which the rows carried no information."""
SHARED, UNSEEN, WEAK = "†", "‡", "*"
LEGEND = {
    SHARED: "can't be separated from others; kept as near to nominal as the rows allow",
    UNSEEN: "unobservable; left at its nominal value",
    WEAK: "barely observable; kept near its nominal value",
}


@dataclass(frozen=True)
class Identified:
    """One parameter of a fit, in SI.

    Args:
        name: As in files, such as `joint2.alpha`.
        std: Standard error; None where there is none.
        is_expected: Whether the standard error is the prior's, as the rows add no information.
        mark: Of those that the rows don't determine: a key of `LEGEND`.
    """

    name: str
    unit: str
    nominal: float
    value: float
    std: float | None
    is_expected: bool = False
    mark: str = ""

    @property
    def shown(self) -> tuple[str, str, str, str]:
        """Nominal value, deviation from it, standard error, and their unit with the mark.

        The deviation has as many decimals as its standard error; what is unknown is empty.
        """
        factor, unit = UNITS.get(self.unit) or readable_unit(self.unit)
        std = factor * self.std if self.std is not None and not self.is_expected else None
        decimals = 3 if std is None else decimals_of(std)
        change = signed(factor * (self.value - self.nominal), decimals)
        change = change if change.startswith("−") or float(change) == 0.0 else f"+{change}"
        return (
            signed(factor * self.nominal, 3),
            "" if self.mark == UNSEEN else change,
            "" if std is None else standard_error(std, decimals),
            f"{unit} {self.mark}".strip(),
        )


IDENTIFIED = ResultFields("name", "unit", "nominal", "value", "std")
"""Of an `Identified`."""


def identified(fit: Fit) -> Iterator[Identified]:
    """The parameters of a fit."""
    shared = {name for c in fit.unidentifiable if len(c.names) > 1 for name in c.names}
    weak = {name for c in fit.weakly_observable for name in c.names}
    prior = np.inf if fit.problem.deviation is None else fit.problem.deviation * np.sqrt(fit.variance_factor)
    limit, hidden = UNINFORMATIVE_RATIO * prior, {c.names[0] for c in fit.unidentifiable if len(c.names) == 1}
    for p, value, std in zip(fit.parameters, fit.x.tolist(), fit.std.tolist(), strict=True):
        mark = UNSEEN if p.name in hidden else SHARED if p.name in shared else WEAK * (p.name in weak)
        known = std if fit.is_assessed and p.name not in hidden else None
        yield Identified(p.name, p.unit, p.nominal, value, known, p.is_geometry and std > limit, mark)


def parameter_blocks(fit: Fit) -> Iterator[Block]:
    """All parameters, and what their marks mean."""
    found = list(identified(fit))
    rows = [(one.name, *one.shown) for one in found]
    if rows:
        headings = ("parameter", "nominal", "deviation", "±", "unit")
        yield ResultTable(f"Deviations from nominal ({fit.algorithm.title})", headings, rows)
    free = {one.name for one in found}
    if held := [e.name for e in fit.problem.robot.elements if e.matrix is None and e.name not in free]:
        yield Sentence(", ".join(held), "held at nominal", Tone.QUIET)
    for mark, text in LEGEND.items():
        if any(one.mark == mark for one in found):
            yield Sentence(f"{mark} {text}", tone=Tone.QUIET)

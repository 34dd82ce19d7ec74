"""An identification and an evaluation as blocks, no wider than 80 columns in a terminal: errors of every
model, the identified parameters, and charts of both."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Wanted
from workbench.identification.errors.row_errors import KINDS, NOTHING, TOOL, AbstractValidation, Errors
from workbench.identification.fit import Fit
from workbench.identification.result import Evaluation, Identification
from workbench.identification.run import Run, judge
from workbench.report.blocks import Block, ResultTable, Sentence, Tone, assembled, lines
from workbench.report.chart import Bar, Bars, Chart, Marks
from workbench.report.colours import CALIBRATED, GEOMETRY, NOMINAL
from workbench.report.numbers import decimals_of, readable_unit, short, signed, standard_error
from workbench.report.result_display import blocks_of
from workbench.report.result_fields import ResultFields

NUMBERS = dict.fromkeys(TOOL, ("mean", "rms", "max")) | {"tilt_deg": ("tilt rms",)}
"""What is shown of each kind of error; of others the rms."""
ONE_DECIMAL_FROM = 100.0
"""Errors above this have one decimal."""
MAX_EXCLUDED = 5
"""Excluded rows that are named."""
UNITS = {"rad": (float(np.rad2deg(1.0)), "°"), "m": (1e3, "mm")}
"""Factor and name of the units in which people read constants; coefficients of effects have their own."""
UNINFORMATIVE_RATIO = 0.8
"""Ratio of a standard error to the prior's above which the rows carried no information."""
SHARED, UNSEEN, WEAK, EXPECTED = "†", "‡", "*", "without ±:"
LEGEND = {
    SHARED: "can't be separated from others; kept as near to nominal as the rows allow",
    UNSEEN: "unobservable; left at its nominal value",
    WEAK: "barely observable; kept near its nominal value",
    EXPECTED: "the rows tell no more of it than was expected of any arm",
}
MAX_POINTS = 400
"""Rows that are drawn at most; of more, evenly chosen ones."""
MAX_POSES = 300
"""Poses that are looked at; of more, evenly chosen ones."""
PLAIN = {"theta": "angle", "d": "offset", "a": "length", "alpha": "twist", "beta": "skew"}
"""Constants in a technician's words."""
MAX_BARS = 8
"""Constants with a bar of their own."""


@blocks_of.register
def identification_blocks(result: Identification, *, wanted: Wanted | None = None) -> list[Block]:
    """Whether it keeps what was wanted, errors, parameters of the best fit, and all notes for the user."""

    def verdict(result: Identification) -> Iterator[Block]:
        if wanted is not None:
            yield Sentence(judge(result.best, wanted).verdict, tone=Tone.STRONG)

    return assembled(result, heading, verdict, models, row_errors, parameters, remarks)


def heading(result: Identification) -> Iterator[Block]:
    rows = f"{plural(len(result.train_rows), 'row')} fitted, {len(result.held_out_data)} held out"
    if result.excluded:
        rows += f", {len(result.excluded)} excluded"
    yield Sentence(f"{result.robot.name}: {rows}", tone=Tone.STRONG)


def models(result: Identification) -> Iterator[Block]:
    """Errors of the nominal arm and of what every algorithm found; a single one is not named."""
    runs = list(result.runs.values())
    found = [(run.fit.algorithm.title if len(runs) > 1 else "calibrated", run) for run in runs]
    yield errors_table([("nominal", result.nominal), *found])


def parameters(result: Identification) -> Iterator[Block]:
    yield from parameter_blocks(result.best.fit)
    yield constant_bars(result.best.fit)


def remarks(result: Identification) -> Iterator[Block]:
    """Unobservable combinations, warnings and decisions."""
    yield from lines("not identifiable", result.unidentifiable)
    yield from lines("warning", result.warnings)
    yield from lines("found", result.identifiability.found(result.best.fit))
    yield from lines("note", result.notes)
    if result.excluded:
        shown = ", ".join(f"row {row} ({reason})" for row, reason in result.excluded[:MAX_EXCLUDED])
        more = len(result.excluded) - MAX_EXCLUDED
        yield Sentence(shown + (f" and {more} more" if more > 0 else ""), "excluded")


@blocks_of.register
def fit_blocks(found: Fit | Run) -> Iterable[Block]:
    return parameter_blocks(found.fit if isinstance(found, Run) else found)


@blocks_of.register
def evaluation_blocks(result: Evaluation) -> list[Block]:
    """Errors of a given model, and the decisions taken."""
    table = table_of([(result.robot.name, f"{len(result.data.row)}", result.errors)])
    warnings = lines("warning", result.warnings)
    chart = row_chart([("", CALIBRATED, result.data.row, result.errors)], "by number")
    return [*warnings, table, chart, *lines("note", result.notes)]


def errors_table(models: Iterable[tuple[str, AbstractValidation]]) -> ResultTable:
    """Errors of several models on fitted and held-out rows, in mm and degrees."""
    return table_of(
        (title if rows == "fitted" else "", rows, errors)
        for title, validated in models
        for rows, errors in (("fitted", validated.train), ("held out", validated.held_out))
        if errors
    )


def table_of(found: Iterable[tuple[str, str, Errors]]) -> ResultTable:
    """Model, which rows, and their errors of every kind that was measured."""
    found = list(found)
    kinds = {kind for *_, errors in found for kind in errors.spreads}
    ordered = [*(kind for kind in KINDS if kind in kinds), *(kinds - KINDS.keys())]
    shown = [(kind, name) for kind in ordered for name in NUMBERS.get(kind, ("rms",))]
    units = {kind: KINDS[kind][2].strip() if kind in KINDS else kind.rpartition("_")[2] for kind in ordered}
    headings = ("model", "rows", *(f"{name}\n[{units[kind]}]" for kind, name in shown))
    rows = []
    for title, which, errors in found:
        values = [getattr(errors.spreads.get(kind, NOTHING), name.split()[-1]) for kind, name in shown]
        rows.append((title, which, *(short(v, 1 if v >= ONE_DECIMAL_FROM else 3) for v in values)))
    return ResultTable("", headings, rows, words=2)


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
    marks = {one.mark for one in found} | {EXPECTED for one in found if one.is_expected and not one.mark}
    for mark, text in LEGEND.items():
        if mark in marks:
            yield Sentence(f"{mark} {text}", tone=Tone.QUIET)


def row_errors(result: Identification) -> Iterator[Block]:
    """Error of every row with the nominal arm and with the best algorithm; rows of another file come last."""
    train, held, best = result.data.row[result.train_rows], result.held_out_data.row, result.best
    if not result.is_one_file:
        held = held + train.max(initial=0) + 1
    models = (
        ("nominal", NOMINAL, train, result.nominal.train),
        ("", NOMINAL, held, result.nominal.held_out),
        ("fitted rows", CALIBRATED, train, best.train),
        ("held-out rows", GEOMETRY, held, best.held_out),
    )
    yield row_chart(models, "nominal and calibrated, by number")


def row_chart(models: Sequence[tuple[str, str, np.ndarray, Errors]], order: str) -> Chart:
    """Errors of the first kind that was measured, on a logarithmic axis.

    Args:
        models: Name in the legend, colour, places of rows along the axis, and their errors.
        order: Of the rows.
    """
    kinds = (kind for kind in KINDS for *_, rows in models if kind in rows.spreads)
    kind, factor, spaced_unit = KINDS[next(kinds, "position_mm")]
    marks, unit = [], spaced_unit.strip()
    for name, colour, place, rows in models:
        some = np.linspace(0, len(place), min(len(place), MAX_POINTS), endpoint=False).astype(int)
        x, y = place[some], factor * getattr(rows, kind)[some]
        titles = [f"{k}: {error:.3g} {unit}" for k, error in zip(x, y, strict=True)]
        marks.append(Marks(x.astype(float), y, colour, titles, name=name * bool(len(place))))
    return Chart(marks, 140.0, is_log=True, title=f"{kind.capitalize()} error of every row [{unit}], {order}")


def constant_bars(fit: Fit) -> Bars:
    """Mean distances by which the changes of constants move the tool at the fitted poses; the smaller ones as
    what each of them amounts to at most."""
    arm, q, found = fit.calibrated.with_effects(), fit.problem.data.q, list[tuple[float, Identified]]()
    poses = Motion(q[np.unique(np.linspace(0, len(q) - 1, min(len(q), MAX_POSES)).round().astype(int))])
    here = tool_poses(arm, poses)[:, :3, 3]
    for p, one in zip(fit.parameters, identified(fit), strict=True):
        if p.is_geometry and one.mark != UNSEEN:
            there = tool_poses(arm.with_values({p.name: p.nominal}), poses)[:, :3, 3]
            found.append((1e3 * float(np.linalg.norm(here - there, axis=1).mean()), one))
    found.sort(key=lambda pair: -pair[0])
    rows = []
    for size, one in found[:MAX_BARS]:
        _, change, std, unit = one.shown
        is_sure = one.std is None or abs(one.value - one.nominal) > 2.0 * one.std
        joint, _, constant = one.name.partition(".")
        plain = "zero" if one.name in fit.problem.robot.joint_offsets else PLAIN.get(constant, constant)
        text = f"{change} {std} {unit.split()[0]}".replace("  ", " ")
        name = f"{joint.replace('joint', 'Joint ')}: {plain}"
        rows.append(Bar(name, size, CALIBRATED if is_sure else NOMINAL, text))
    if others := found[MAX_BARS:]:
        rows.append(Bar(f"Each of {len(others)} others, at most", others[0][0], NOMINAL))
    title = "How far each change of a constant moves the tool [mm]; grey: within twice its standard error"
    return Bars(rows, title, testid="constants")

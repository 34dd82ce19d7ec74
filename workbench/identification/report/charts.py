"""Charts of an identification: the error of every row, and how far each constant moves the tool."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.identification.errors.row_errors import KINDS, RowErrors
from workbench.identification.fit import Fit
from workbench.identification.report.parameters import identified, unseen
from workbench.identification.result import Identification, order_of_measuring
from workbench.report.chart import Bar, Bars, Chart, Marks
from workbench.report.colours import CALIBRATED, GEOMETRY, NOMINAL

MAX_POINTS = 400
"""Rows that are drawn at most; of more, evenly chosen ones."""
MAX_POSES = 300
"""Poses that are looked at; of more, evenly chosen ones."""
PLAIN = {"theta": "angle", "d": "offset", "a": "length", "alpha": "twist", "beta": "skew"}
"""Constants in a technician's words."""
MAX_BARS = 8
"""Constants with a bar of their own."""


def before_after(result: Identification) -> Chart:
    """Error of every row with the nominal arm and with the best algorithm, in the order of measuring."""
    place, fitted, best = order_of_measuring(result), len(result.train_rows), result.best
    train, held = place[:fitted], place[fitted:]
    models = (
        ("nominal", NOMINAL, train, result.nominal.train_rows),
        ("", NOMINAL, held, result.nominal.held_out_rows),
        ("fitted rows", CALIBRATED, train, best.train_rows),
        ("held-out rows", GEOMETRY, held, best.held_out_rows),
    )
    return row_chart(models, "nominal and calibrated, in the order of measuring")


def row_chart(models: Sequence[tuple[str, str, np.ndarray, RowErrors]], order: str) -> Chart:
    """Errors of the first kind that was measured, on a logarithmic axis.

    Args:
        models: Name in the legend, colour, places of rows along the axis, and their errors.
        order: Of the rows.
    """
    kinds = (kind for kind in KINDS for *_, rows in models if np.isfinite(getattr(rows, kind[1])).any())
    _, kind, _, factor, spaced_unit = next(kinds, KINDS[0])
    marks, unit = [], spaced_unit.strip()
    for name, colour, place, rows in models:
        some = np.linspace(0, len(place), min(len(place), MAX_POINTS), endpoint=False).astype(int)
        x, y = place[some], factor * getattr(rows, kind)[some]
        titles = [f"{k}: {error:.3g} {unit}" for k, error in zip(x, y, strict=True)]
        marks.append(Marks(x.astype(float), y, colour, titles, name=name * bool(len(place))))
    return Chart(marks, 140.0, is_log=True, title=f"{kind.capitalize()} error of every row [{unit}], {order}")


TITLE = "How far each change of a constant moves the tool [mm]; grey: within twice its standard error"


class ChangedConstant(NamedTuple):
    """A constant of the arm, from nominal to identified.

    Args:
        name: As in the result, such as `joint2.alpha`.
        change: Identified less nominal [rad or m].
        moved: Mean distance by which that moves the tool at the fitted poses [m].
    """

    name: str
    unit: str
    change: float
    moved: float


def changed_constants(fit: Fit) -> list[ChangedConstant]:
    """All constants of the arm that the rows determine, what moves the tool most first."""
    arm, hidden, q = fit.calibrated.with_effects(), unseen(fit), fit.problem.data.q
    poses = Motion(q[np.unique(np.linspace(0, len(q) - 1, min(len(q), MAX_POSES)).round().astype(int))])
    here, found = tool_poses(arm, poses)[:, :3, 3], []
    for p, value in zip(fit.parameters, fit.x.tolist(), strict=True):
        if p.is_geometry and p.name not in hidden:
            there = tool_poses(arm.with_values({p.name: p.nominal}), poses)[:, :3, 3]
            moved = float(np.linalg.norm(here - there, axis=1).mean())
            found.append(ChangedConstant(p.name, p.unit, value - p.nominal, moved))
    return sorted(found, key=lambda one: -one.moved)


def constant_bars(fit: Fit) -> Bars:
    """The largest as bars in mm with their change; what the others amount to each at most."""
    found = changed_constants(fit)
    told = {each.name: each for each in identified(fit)}
    rows = []
    for one in found[:MAX_BARS]:
        (_, change, std, unit), known = told[one.name].shown, told[one.name].std
        colour = CALIBRATED if known is None or abs(one.change) > 2.0 * known else NOMINAL
        size = f"{change} {std}" if std else change
        joint, _, constant = one.name.partition(".")
        plain = "zero" if one.name in fit.problem.robot.joint_offsets else PLAIN.get(constant, constant)
        name = f"{joint.replace('joint', 'Joint ')}: {plain}"
        rows.append(Bar(name, 1e3 * one.moved, colour, f"{size} {unit.split()[0]}"))
    if others := found[MAX_BARS:]:
        rows.append(Bar(f"Each of {len(others)} others, at most", 1e3 * others[0].moved, NOMINAL))
    return Bars(rows, TITLE, testid="constants")

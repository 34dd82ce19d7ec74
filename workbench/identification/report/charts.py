"""Charts of an identification: the error of every row, and how far each constant moves the tool."""

from collections.abc import Sequence

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.identification.errors.row_errors import KINDS, Errors
from workbench.identification.fit import Fit
from workbench.identification.report.parameters import UNSEEN, Identified, identified
from workbench.identification.result import Identification
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
    return row_chart(models, "nominal and calibrated, by number")


def row_chart(models: Sequence[tuple[str, str, np.ndarray, Errors]], order: str) -> Chart:
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

"""The report as one self-contained HTML page: no network, no scripts, embedded pictures.

All text passes through the template's escaping; only our own pictures are inserted verbatim.
"""

from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.advice import failures
from workbench.base.files import check_folder
from workbench.base.progress import part_of, progress
from workbench.data.accuracy_requirement import Wanted, WantedCheck
from workbench.extras.reports.identification_figures import NAMES, all_figures
from workbench.identification.errors.pass_or_fail import Judged, judge
from workbench.identification.report.how_to_apply import Use, controller_use
from workbench.identification.report.parameters import LEGEND, Cell, parameter_table
from workbench.identification.report.results_json import identification_json
from workbench.identification.report.table import error_cards
from workbench.identification.result import Identification, Run, error_rows
from workbench.report.html import write_page
from workbench.report.numbers import short
from workbench.report.sections import sections_of

PAGE = "report.html"
LISTED = 50
"""Maximum number of rows in a list on the page; all rows are in the JSON file."""


def write_report(result: Identification, folder: Path | str, *, wanted: Wanted | None = None) -> Path:
    """Write `report.html`, its pictures as SVG files and `result.json`: all of them or nothing.

    An older report in the folder is replaced; other files in it stay.

    Args:
        folder: Made if it is not there.
        wanted: Required error of every pose; no verdict if None.
    """
    check_folder(folder)
    with failures() as failed:
        with part_of(0.1, 0.7):
            drawings = all_figures(result, wanted=wanted)
        progress(0.8, "numbers for the controller")
        use = controller_use(result)
        progress(0.9, "writing the page")
        judged = None if wanted is None else judge(result, wanted)
        content = identification_json(result)
        content |= {"requirement": judged and _requirement_json(judged), "controller": use.json()}
        old = [f"{name}.svg" for name in NAMES]
        fields = _text(result, judged=judged, use=use)
        fields["sections"], more = sections_of(result)
    fields["warnings"] = (*result.warnings, *failed)
    path = write_page(
        folder, PAGE, drawings, content | more, replaces=old, package="workbench.extras.reports", **fields
    )
    progress(1.0, "done")
    return path


def _text(result: Identification, *, judged: Judged | None, use: Use) -> dict[str, Any]:
    """The template's fields."""
    best, (before, after) = result.best, result.error
    return {
        "robot": result.robot.name,
        "source": result.data.source,
        "facts": _facts(result),
        "best": best.fit.title,
        "held_out": best.held_out is not None,
        "cards": error_cards(before, after),
        "errors": error_rows([("Nominal", result.nominal), *result.models]),
        "turned": after.orientation_deg is not None,
        "judged": judged,
        "check_axes": [] if judged is None else _axes(judged.check),
        "check_strip": [] if judged is None else _strip(judged.check),
        "listed": LISTED,
        "algorithms": [_algorithm(run, run is best) for run in result.runs.values()],
        "legend": LEGEND,
        "unidentifiable": result.unidentifiable,
        "warnings": result.warnings,
        "notes": result.notes,
        "excluded": result.excluded[:LISTED],
        "excluded_count": len(result.excluded),
        "suspicious": _suspicious(best)[:LISTED],
        "suspicious_count": len(best.fit.suspicious),
        "use": use,
    }


def _requirement_json(judged: Judged) -> dict[str, Any]:
    check = judged.check
    return {
        **check.wanted.json(),
        "rows": "held_out" if judged.held_out else "train",
        "share_passed": check.share,
        "passed": judged.rows[check.passed].tolist(),
        "failed": judged.failed,
        "with_orientation": not check.unmeasured,
    }


def _facts(result: Identification) -> list[tuple[str, str]]:
    data, held_out = result.data, result.held_out_data
    columns = ("position", "rotation", "markers", "distance", "contact")
    seen = ["orientation" if n == "rotation" else n for n in columns if getattr(data, n) is not None]
    facts = [
        ("Robot", f"{result.robot.name} ({result.robot.convention}, {result.robot.dof} joints)"),
        ("File", data.source),
        ("Quantities", ", ".join(seen) or "nothing"),
        (
            "Rows",
            f"{len(result.train_rows)} fitted, {len(held_out)} held out, {len(result.excluded)} excluded",
        ),
    ]
    if len(data.sessions) > 1:
        facts.append(("Sessions", f"{len(data.sessions)}: {', '.join(data.sessions)}"))
    noise = result.noise if data.rotation is not None else result.noise._replace(rotation=np.nan)
    facts.append(("Assumed noise", noise.text))
    facts.append(("Parameters", f"{len(result.best.fit.problem.names)} free parameters"))
    return facts


def _axes(check: WantedCheck) -> list[dict[str, Any]]:
    lines = []
    axes = "XYZ" if check.wanted.per_axis else ("",)
    for k, (limit, worst, share) in enumerate(zip(check.limits, check.worst, check.shares, strict=True)):
        if np.isfinite(worst):
            turned = k >= len(axes)
            scale, unit = (float(np.rad2deg(1.0)), "°") if turned else (1e3, " mm")
            name = f"{'Orientation' if turned else 'Position'} {axes[k % len(axes)]}".strip()
            line = {
                "name": name,
                "limit": f"{limit * scale:.2f}{unit}",
                "worst": f"{short(worst * scale)}{unit}",
            }
            lines.append(line | {"share": f"{100.0 * share:.1f} %", "ok": share == 1.0})
    return lines


def _strip(check: WantedCheck) -> list[tuple[float, float]]:
    """Runs of failing rows for a bar: start and length in percent of all judged rows."""
    failed = ~check.passed[check.judged]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], failed, [False]]).astype(int)))
    scale = 100.0 / max(len(failed), 1)
    return [(round(a * scale, 3), round((b - a) * scale, 3)) for a, b in edges.reshape(-1, 2)]


def _algorithm(run: Run, best: bool) -> dict[str, Any]:
    fit = run.fit
    table = parameter_table(fit)
    return {
        "title": fit.title,
        "best": best,
        "outcome": str(fit.outcome),
        "ok": fit.outcome.ok,
        "iterations": fit.iterations,
        "seconds": fit.seconds,
        "condition": f"{fit.condition:.3g}",
        "headings": table.headings,
        "rows": [(joint, [_cell(c) for c in cells]) for joint, cells in table.rows],
        "others": [(_cell(c) or {}) | {"name": c.name, "unit": c.readable_unit} for c in table.others],
        "marks": table.marks,
    }


def _cell(cell: Cell | None) -> dict[str, str] | None:
    if cell is None:
        return None
    nominal, change, std = cell.shown
    return {"nominal": nominal, "value": change, "std": std, "mark": str(cell.state)}


def _suspicious(run: Run) -> list[tuple[int, str]]:
    fit = run.fit
    typical = max(float(np.median(fit.row_residuals)), 1e-12)
    return [(int(fit.problem.data.row[i]), f"{fit.row_residuals[i] / typical:.1f}") for i in fit.suspicious]

"""A corrected trajectory for people and for machines: the schema `workbench.compensation/1`."""

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table, box
from rich.text import Text

from workbench.identification.errors import Spread
from workbench.paths.correction import Compensation, PathErrors
from workbench.report.json import Json, plain
from workbench.report.numbers import short

COMPENSATION = "workbench.compensation/1"


def compensation_json(found: Compensation) -> Json:
    """The result as plain data; rows count from 0, errors are those that the calibrated model predicts."""
    time = found.motion.time
    columns = {
        "row": np.arange(len(found.q)),
        "time": [None] * len(found.q) if time is None else time,
        "before_mm": 1e3 * found.before.position,
        "after_mm": 1e3 * found.after.position,
        "kept": found.kept,
    }
    return plain(
        {
            "schema": COMPENSATION,
            "robot": found.commanded.calibrated.name,
            "method": str(found.method),
            "task": found.commanded.task.name.lower(),
            "effects": [e.name for e in found.commanded.calibrated.effects],
            "before": _errors(found.before),
            "after": _errors(found.after),
            "largest_correction": np.abs(found.q - found.commanded.q).max(0),
            "greatest_speed": found.speed,
            "rows": [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
            "notes": list(found.notes),
        }
    )


def compensation_table(found: Compensation) -> RenderableType:
    """Predicted errors before and after, and what was decided."""
    table = Table(box=box.SIMPLE_HEAD, title_justify="left")
    for heading in ("predicted error", "mean [mm]", "max [mm]", "mean [°]", "max [°]"):
        table.add_column(escape(heading), justify="left" if heading.startswith("p") else "right")
    for words, errors in (("as commanded", found.before), (f"corrected ({found.method})", found.after)):
        position, turn = Spread.of(1e3 * errors.position), Spread.of(np.rad2deg(errors.rotation))
        table.add_row(words, *(short(v) for v in (position.mean, position.max, turn.mean, turn.max)))
    notes = [Text(f"note: {note}") for note in found.notes]
    return Group(Text(f"{found.commanded.calibrated.name}: {len(found.q)} rows", style="bold"), table, *notes)


def _errors(errors: PathErrors) -> Json:
    return {
        "position_mm": Spread.of(1e3 * errors.position)._asdict(),
        "orientation_deg": Spread.of(np.rad2deg(errors.rotation))._asdict(),
    }

"""A fleet as tables, as plain data (`workbench.fleet/1`), and as a page with its pictures."""

from pathlib import Path

from rich.console import Group, RenderableType
from rich.text import Text

from workbench.identification.fleet.fleet import ArmReport, Fleet
from workbench.identification.fleet.movement import Law, Movement
from workbench.identification.fleet.pictures import DRIFT, FLEET, drift_chart, fleet_chart
from workbench.report.figures import Drawing, svg
from workbench.report.html import write_page
from workbench.report.json import Json, plain
from workbench.report.tables import line, new_table

SCHEMA = "workbench.fleet/1"
PAGE = "fleet.html"
LISTED, DRAWN, PAGE_ROWS = 15, 6, 200
"""Arms in the terminal's table, with a chart of their own, and in the page's table."""
HEADS = ("arm", "moved most", "by", "σ", "since", "tool\n[mm]", "again by")


def arm_cells(arm: ArmReport) -> tuple[str, ...]:
    """One arm's line, as `HEADS` has it."""
    worst, dates = arm.worst, arm.history.dates
    if worst is None:
        return (arm.history.arm, "nothing" if len(dates) > 1 else "one calibration", *["–"] * 5)
    return (
        arm.history.arm,
        worst.name,
        shift_words(worst),
        f"{worst.sigmas:.0f}",
        "drifts" if worst.law is Law.DRIFT else f"{worst.since}",
        f"{1e3 * arm.tool:.2f}",
        "–" if arm.again is None else f"{arm.again}",
    )


def shift_words(moved: Movement) -> str:
    """How far a constant moved."""
    unit = "mrad" if moved.name.endswith(("theta", "alpha", "beta")) else "10⁻³"
    unit = "mm" if moved.name.endswith((".a", ".d")) else unit
    return f"{1e3 * moved.shift:+.3g} {unit}".replace("-", "−")


def fleet_tables(fleet: Fleet) -> RenderableType:
    """The worst arms, those that could not be read, and what was decided."""
    table = new_table(f"{len(fleet.arms)} arms", *HEADS)
    shown = (fleet.worn or fleet.worst_first)[:LISTED]
    for arm in shown:
        table.add_row(*arm_cells(arm))
    parts: list[RenderableType] = [table]
    if (more := len(fleet.worn) - LISTED) > 0:
        parts.append(Text(f"and {more} more"))
    parts.append(Text(fleet.verdict, style="bold"))
    parts += [line("warning", f"{arm.arm}: {arm.why}") for arm in fleet.unread[:LISTED]]
    return Group(*parts, *(line("note", words) for words in notes_of(fleet)))


def notes_of(fleet: Fleet) -> tuple[str, ...]:
    """What was decided, one sentence each."""
    notes = [
        f"something moved beyond {fleet.least:.1f} σ, which chance exceeds in one such fleet of a hundred",
        f"again by: when a drift will have moved the tool by {1e3 * fleet.allowed:.3g} mm since the last "
        "calibration",
    ]
    if fleet.factor > 1.0:
        notes.append(
            f"calibrations scatter {fleet.factor:.2f} times as far as their standard errors say; σ is widened"
        )
    return tuple(notes)


def fleet_json(fleet: Fleet) -> Json:
    """The result as plain data."""
    return plain(
        {
            "schema": SCHEMA,
            "verdict": fleet.verdict,
            "sigma_factor": fleet.factor,
            "threshold_sigmas": fleet.least,
            "allowed_mm": 1e3 * fleet.allowed,
            "arms": [
                {
                    "arm": arm.history.arm,
                    "dates": [day.isoformat() for day in arm.history.dates],
                    "worst_joint": arm.joint,
                    "tool_mm": 1e3 * arm.tool,
                    "again_by": None if arm.again is None else arm.again.isoformat(),
                    "moved": [_moved(m) for m in arm.moved],
                }
                for arm in fleet.worst_first
            ],
            "unread": [{"arm": arm.arm, "reason": arm.why} for arm in fleet.unread],
            "notes": list(notes_of(fleet)),
        }
    )


def _moved(moved: Movement) -> Json:
    return {
        "name": moved.name,
        "joint": moved.joint,
        "law": str(moved.law),
        "shift": moved.shift,
        "std": moved.std,
        "sigmas": moved.sigmas,
        "since": moved.since.isoformat(),
        "rate_per_day": moved.rate,
        "tool_mm": 1e3 * moved.tool,
    }


def write_fleet(fleet: Fleet, folder: Path | str) -> Path:
    """Write `fleet.html`, its pictures as SVG files and `result.json`; returns the page's path."""
    drawings = [Drawing("fleet", "Joints of all arms", FLEET, svg(fleet_chart(fleet), "fleet"))]
    for number, arm in enumerate((fleet.worn or fleet.worst_first)[:DRAWN], 1):
        name = f"drift-{number}"
        picture = svg(drift_chart(arm, factor=fleet.factor), name)
        drawings.append(Drawing(name, arm.history.arm, DRIFT, picture))
    return write_page(
        folder,
        PAGE,
        drawings,
        fleet_json(fleet),
        replaces=[f"drift-{number}.svg" for number in range(1, DRAWN + 1)],
        fleet=fleet,
        heads=HEADS,
        rows=[arm_cells(arm) for arm in fleet.worn[:PAGE_ROWS]],
        more=max(len(fleet.worn) - PAGE_ROWS, 0),
        still=[f"{arm.history.arm} ({len(arm.history.dates)})" for arm in fleet.arms if not arm.moved],
        unread=[f"{arm.arm}: {arm.why}" for arm in fleet.unread],
        notes=notes_of(fleet),
    )

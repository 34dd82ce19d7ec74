"""The commands about measurements: simulate, preview."""

from pathlib import Path
from typing import Annotated, Any

import workbench as wb
from workbench.base.errors import DataError, OptionError
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.options import option


def simulate(
    robot: opt.RobotOption,
    out: Annotated[Path, option("Write the measurements here.")],
    plate: opt.PlateOption = None,
    poses: Annotated[int | None, option("Number of poses, instead of a plate.")] = None,
    choice: Annotated[str, option("With --poses: random, or iso-cube (ISO 9283).")] = "random",
    instrument: Annotated[
        str | None, option("Instrument: plate, laser-tracker, tracker-6d, optotrak …")
    ] = None,
    effect: Annotated[
        list[str] | None, option("A hidden effect, NAME[:joint[:size]], such as backlash:3. May be repeated.")
    ] = None,
    actual: Annotated[Path | None, option("Write the hidden actual arm here (.toml).")] = None,
    of: Annotated[str | None, option("Measure this arm instead of one with random errors.")] = None,
    errors: Annotated[str, option("Maximum hidden errors of lengths and of angles.")] = "1mm,0.3deg",
    seed: opt.SeedOption = 0,
) -> None:
    """Simulate measurements of a virtual arm with hidden manufacturing errors."""
    from workbench.arm.joint_units import sliding_numbers

    if (plate is None) == (poses is None):  # one of the two is given
        raise OptionError("give either --plate FILE or --poses NUMBER")
    opt.check_writable(out, actual)
    arm = wb.load_robot(robot)
    how: dict[str, Any] = {"actual": of, "effects": effect or (), "errors": errors, "seed": seed}
    with opt.progress_bar("simulate"):
        if plate is not None:
            how |= {"instrument": instrument or "plate"}
            hidden, rows = wb.measure_plate(arm, wb.load_plate(plate), **how)
        elif poses is not None:
            how |= {"choice": choice, "instrument": instrument or "tracker-6d"}
            hidden, rows = wb.measure_poses(arm, poses, **how)
    wb.write_measurements(rows, out, prismatic=sliding_numbers(arm))
    opt.say(f"{plural(len(rows), 'row')} simulated on a virtual {arm.name}: {out}")
    for note in rows.notes:
        if note.startswith("hidden"):
            opt.say(note)
    if rows.exclude is not None and rows.reason is not None:
        for number in rows.exclude.nonzero()[0]:
            opt.say(f"row {rows.row[number]} excluded: {rows.reason[number]}")
    if actual is not None:
        opt.say(f"hidden actual arm: {wb.write_toml(hidden, actual)}")
    content = {"schema": "workbench.simulation/1", "robot": arm.name, "file": str(out), "rows": len(rows)}
    opt.write_result(content | {"excluded": rows.row[~rows.included], "notes": rows.notes})


def preview(data: opt.DataArgument, files: opt.FileOptions) -> None:
    """Show how a file is read: every column with its meaning and unit, decisions, problems."""
    from workbench.data.readers.read import preview
    from workbench.report.blocks import ResultTable, lines

    found = preview(data, **files.stated)
    title = f"{data.name}: {plural(found.rows, 'row')}, layout {found.layout}"
    rows = [(c.heading, c.key or "ignored", c.unit or "", c.si or "") for c in found.columns]
    table = [ResultTable(title, ("heading", "meaning", "unit", "SI unit"), rows, words=4)] if rows else []
    columns = [dict(zip(("heading", "meaning", "unit", "si_unit"), row, strict=True)) for row in rows]
    content = {"schema": "workbench.preview/1", "rows": found.rows, "joints": found.joints}
    content |= {"layout": found.layout, "columns": columns, "notes": found.decisions}
    opt.show([*table, *lines("note", found.decisions)])
    opt.write_result(content | {"problems": found.problems})
    if found.problems:
        raise DataError("; ".join(found.problems))

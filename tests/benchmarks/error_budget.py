"""What the error of each measured arm is made of, as a stacked bar of what each step takes off it.

    python tests/benchmarks/error_budget.py --json budget.jsonl --picture assets/pictures/error-budget.png \
        --order assets/pictures/error-order.png

Every arm is diagnosed on four fifths of its rows (whole grid points of the UR10); all figures are mean errors
of the fifth that took no part. Geometry: from the nominal arm with the best base and tool to the identified
one. Causes: effects that are named. Map: effects that predict and claim nothing. Left: noise, and what
nothing holds. `--order` draws what is left of the fitted rows in the order in which they were measured.
"""

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "diagnosis")]

import numpy as np
from ledger import Ledger
from matplotlib.figure import Figure
from real_arms import SETS, load, set_names, splits
from rich.console import Console

from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.report.budget import budget
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, look, new_figure, on_white, png
from workbench.report.tables import new_table

DATA = TESTS.parents[1] / "shared" / "data"
PARTS = ("geometry", "causes", "map", "left")
SHADES = (COLOURS[0], COLOURS[1], COLOURS[4], NOMINAL)
NAMES = {
    "ur10": "UR10",
    "ur5": "UR5",
    "wam": "WAM",
    "panda_1": "Panda 1",
    "panda_3": "Panda 3",
    "iiwa14": "iiwa 14",
}


def bars(found: dict[str, dict[str, float]]) -> Figure:
    """One bar an arm, as shares of its nominal error, with the millimetres written in."""
    with look():
        figure = new_figure(8.4, 0.52 * len(found) + 0.9)
        axes = figure.subplots()
        for place, parts in enumerate(found.values()):
            whole, start = sum(parts.values()), 0.0
            for part, shade in zip(PARTS, SHADES, strict=True):
                share = 100.0 * parts[part] / whole
                axes.barh(
                    place, share, left=start, height=0.62, color=shade, label=part if not place else None
                )
                if share > 6.0:
                    message = f"{parts[part]:.2g}"
                    axes.text(start + 0.5 * share, place, message, ha="center", va="center", color="white")
                start += share
            axes.text(101.0, place, f"{whole:.2f} mm", va="center", clip_on=False)
        axes.set_yticks(range(len(found)), [NAMES.get(name, name) for name in found])
        axes.invert_yaxis()
        axes.set_xlim(0.0, 100.0)
        axes.set_xticks(range(0, 101, 20))
        axes.set_xlabel("share of the nominal arm's mean error on held-out rows [%]; figures in mm")
        figure.legend(loc="outside upper center", ncols=len(PARTS))
    return figure


def left_in_order(result) -> dict[str, list]:
    """What is left along the axis of the measuring frame in which rows after each other agree most."""
    fitted = result.after_fit.problem.data
    table = result.residuals().loc[np.sort(fitted.row)]
    axes = [1e3 * table[name].to_numpy() for name in ("x[m]", "y[m]", "z[m]")]
    best = int(np.argmax([r[1:] @ r[:-1] / (r @ r) for r in axes]))
    names = np.full(len(fitted), "") if fitted.session is None else fitted.session
    return {
        "axis": "xyz"[best],
        "row": table.index.tolist(),
        "left_mm": axes[best].round(4).tolist(),
        "session": names[np.argsort(fitted.row)].tolist(),
    }


def orders(found: dict[str, dict]) -> Figure:
    """One panel an arm: what is left of every row, a running mean, and where sessions begin."""
    with look():
        figure = new_figure(8.4, 1.25 * len(found) + 0.3)
        panels = figure.subplots(len(found), 1, squeeze=False)[:, 0]
        for axes, (name, left) in zip(panels, found.items(), strict=True):
            row, size, session = (np.array(left[part]) for part in ("row", "left_mm", "session"))
            count = max(9, len(row) // 80)
            mean = np.ones(count) / count
            axes.axhline(0.0, color=NOMINAL, lw=0.6)
            axes.plot(row, size, ".", ms=3.0 if len(row) < 2000 else 1.0, color=COLOURS[0], alpha=0.6, mew=0)
            axes.plot(*(np.convolve(v, mean, mode="valid") for v in (row, size)), color=COLOURS[1], lw=1.2)
            for first in np.flatnonzero(session[1:] != session[:-1]) + 1:
                axes.axvline(row[first], color=NOMINAL, ls=":", lw=1.0)
            axes.set_ylabel(f"{NAMES.get(name, name)}\n{left['axis']} [mm]")
            axes.set_xlim(row[0], row[-1])
        axes.set_xlabel("row of the file; dotted: another session")
    return figure


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=set_names, default=list(SETS), help="sets, commas between")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the measurements")
    parser.add_argument("--json", type=Path, help="keep every figure in this file, and go on from it")
    parser.add_argument("--picture", type=Path, help="draw the bars here (.png)")
    parser.add_argument("--order", type=Path, help="draw what is left in the order of the rows here (.png)")
    given = parser.parse_args(arguments)
    ledger = Ledger(given.json)
    for name in given.sets:
        if name not in ledger:
            robot, data = load(given.data, name)
            train, held = next(iter(splits(data, 0, 5)))
            result = diagnose(robot, train, held_out=held)
            text = [cause.sentence for cause in result.causes]
            record = {"parts": budget(result), "causes": text, "verdict": str(result.verdict)}
            ledger.add(name, record | {"order": left_in_order(result)})
    table = new_table("mean error on held-out rows [mm]", "arm", *PARTS)
    for name, record in ledger.records.items():
        table.add_row(name, *(f"{record['parts'][part]:.3f}" for part in PARTS))
    console = Console()
    console.print(table)
    for name, record in ledger.records.items():
        console.print(f"{name}: {'; '.join(record['causes']) or 'no cause is named'}", highlight=False)
    if given.picture is not None:
        figure = bars({name: record["parts"] for name, record in ledger.records.items()})
        given.picture.write_bytes(png(on_white(figure)))
    if given.order is not None:
        figure = orders({name: record["order"] for name, record in ledger.records.items()})
        given.order.write_bytes(png(on_white(figure)))
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""What was measured, as one table: rich where it is installed, else plain text."""

import statistics
from dataclasses import dataclass, field

import task

COLUMNS = ("what", "parameters", "time or rate", "ratio", "held-out error", "… axes tilted", "how")
MARK = {True: "✓", False: "✗", None: ""}


@dataclass
class Table:
    """Rows under headings, and the bounds that were checked.

    Args:
        rows: Cells in the order of `COLUMNS`; a heading has one cell.
        checks: Bound in words, value in words, whether it holds (None: not measured).
    """

    rows: list = field(default_factory=list)
    checks: list = field(default_factory=list)

    def heading(self, text):
        self.rows.append((text,))

    def add(self, *cells):
        self.rows.append(cells + ("",) * (len(COLUMNS) - len(cells)))

    def check(self, bound, value, holds):
        self.checks.append((bound, value, holds))

    @property
    def good(self):
        """Whether no bound is broken."""
        return all(holds is not False for *_, holds in self.checks)


def seconds(value):
    """A time in readable units."""
    return f"{value:.2f} s" if value >= 1 else f"{1e3 * value:.3g} ms"


def count(value):
    """A rate or number of rows in readable units."""
    for size, name in ((1e6, "M"), (1e3, "k")):
        if value >= size:
            return f"{value / size:.3g} {name}"
    return f"{value:.3g}"


def error(entry, rotation):
    """Held-out error in words."""
    millimetres, degrees = entry["error"]
    return f"{millimetres:.3f} mm" + (f", {degrees:.4f}°" if rotation else "")


def median(path, arm="plain"):
    """Median seconds of one way of identifying."""
    return statistics.median(path["arms"][arm]["seconds"])


def compared(table, reports, arrays, reference):
    """The rows of all packages: identification, then poses with Jacobian; missing ones with the reason."""
    for report in reports.values():
        for path in report.get("paths", ()):
            for arm, entry in path["arms"].items():
                entry["error"] = task.errors(entry["predicted"], arrays[f"{arm}_held_out"])
    nominal = [task.errors(task.forward(arrays["q_held_out"]), arrays[f"{a}_held_out"]) for a in task.ARMS]
    table.heading(f"identification from {len(arrays['q'])} poses")
    ours = next((median(p) for p in reports["workbench"].get("paths", ()) if p["name"] == reference), None)
    table.add("nominal arm", "", "", "", *(f"{mm:.2f} mm, {deg:.2f}°" for mm, deg in nominal))
    for package, report in reports.items():
        if "failed" in report:
            table.add(package, "", "not measured", "", "", "", report["failed"])
        for path in report.get("paths", ()):
            spread = sorted(path["arms"]["plain"]["seconds"])
            took = f"{seconds(median(path))} ({seconds(spread[0])} … {seconds(spread[-1])})"
            ratio = f"{median(path) / ours:.3g}×" if ours else ""
            shown = [error(path["arms"][arm], path["rotation"]) for arm in task.ARMS]
            evaluations = path["arms"]["plain"]["evaluations"]
            how = f"{path['how']}; {evaluations} evaluations"
            table.add(f"{package}: {path['name']}", str(path["parameters"]), took, ratio, *shown, how)
    table.heading("poses with identification Jacobian")
    best = max((r["poses_per_second"] for r in reports["workbench"].get("rates", ())), default=None)
    for package, report in reports.items():
        for rate in report.get("rates", ()):
            value = rate["poses_per_second"]
            ratio = f"{best / value:.3g}×" if best else ""
            table.add(f"{package}: {rate['name']}", "", f"{count(value)} poses/s", ratio, "", "", rate["how"])
    return ours, best


def show(table, title):
    """Print the table and its checks."""
    try:
        _show_rich(table, title)
    except ImportError:
        _show_plain(table, title)


def _show_rich(table, title):
    from rich.console import Console
    from rich.table import Table as Grid

    console = Console()
    if not console.is_terminal:
        console = Console(width=190)
    grid = Grid(title=title, title_justify="left")
    for i, name in enumerate(COLUMNS):
        grid.add_column(name, justify="right" if 1 <= i <= 3 else "left")
    for row in table.rows:
        if len(row) == 1:
            grid.add_section()
            grid.add_row(f"[bold]{row[0]}[/bold]")
        else:
            grid.add_row(*row)
    console.print(grid)
    for bound, value, holds in table.checks:
        colour = {True: "green", False: "red", None: "dim"}[holds]
        console.print(f"[{colour}]{MARK[holds] or '–'}[/{colour}] {bound}: {value}", highlight=False)


def _show_plain(table, title):
    print(title)
    full = [r for r in [COLUMNS, *table.rows] if len(r) > 1]
    widths = [max(len(r[i]) for r in full) for i in range(len(COLUMNS))]
    for row in [COLUMNS, *table.rows]:
        line = "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=False)).rstrip()
        print(("\n" if len(row) == 1 else "") + line)
    print()
    for bound, value, holds in table.checks:
        print(f"{MARK[holds] or '–'} {bound}: {value}")

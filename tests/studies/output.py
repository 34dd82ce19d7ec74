"""What a work done again leaves in a folder: its tables, its figures, and everything as JSON."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from studies.finding import Finding, verdicts
from workbench.base.files import write_folder
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, grid, look, new_figure, png
from workbench.report.json import json_text

SCHEMA = "workbench.reproduction/1"
TABLES, RESULT = "tables.md", "result.json"

Json = dict[str, Any]


class Sheet(NamedTuple):
    """A table of a work: its numbers and ours, and what must be known to read it."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""

    def markdown(self) -> str:
        """The table as text."""
        lines = (self.headings, ("---",) * len(self.headings), *self.rows)
        table = "\n".join(" | ".join(cell.replace("|", "∣") for cell in line) for line in lines)
        return f"## {self.title}\n\n{self.note}\n\n{table}\n"


@dataclass(frozen=True, eq=False, kw_only=True)
class Output:
    """A work done again, to be written.

    Args:
        work: Its short name.
        source: Where it was printed.
        findings: Printed numbers beside ours.
        sheets: Its tables.
        figures: Its figures by file name.
        numbers: What else the JSON has.
    """

    work: str
    source: str
    findings: tuple[Finding, ...]
    sheets: tuple[Sheet, ...]
    figures: Mapping[str, Figure]
    numbers: Json

    @property
    def json(self) -> Json:
        """Every finding, and the spread of errors over the arms."""
        return {
            "schema": SCHEMA,
            "work": self.work,
            "source": self.source,
            "verdicts": verdicts(self.findings),
            "findings": [asdict(finding) for finding in self.findings],
            **self.numbers,
        }

    def write(self, folder: Path | str) -> Path:
        """Write tables, figures and numbers; whatever else the folder holds stays."""
        rows = tuple(tuple(str(cell) for cell in asdict(f).values()) for f in self.findings)
        findings = Sheet("Printed and here", ("where", "what", "printed", "here", "verdict", "why"), rows)
        text = "\n".join([f"# {self.source}\n", *(s.markdown() for s in (findings, *self.sheets))])
        files = {f"{name}.png": png(figure) for name, figure in self.figures.items()}
        return write_folder(folder, files | {TABLES: text.encode(), RESULT: json_text(self.json).encode()})


def curves(time: np.ndarray, rows: np.ndarray, titles: tuple[str, ...], what: str) -> Figure:
    """Distances over time [s], one colour a row; the first is grey."""
    with look():
        figure = new_figure(7.5, 3.4)
        axes = figure.subplots()
        for row, title, colour in zip(rows, titles, (NOMINAL, *COLOURS), strict=False):
            axes.plot(time, row, color=colour, label=title)
        axes.set(xlabel="time [s]", ylabel=what)
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        grid(axes)
    return figure

"""Reports with several tables in one file: the one with joints is read, or the only one that is known."""

from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

from workbench.base.errors import FileError
from workbench.base.units import parse_heading
from workbench.data.readers.headings import is_known, meaning
from workbench.data.readers.table import NUMBER, Grid


class _Part(NamedTuple):
    """A table in a grid: row of its headings and end of its rows; known columns, and whether joints are."""

    start: int
    end: int
    known: int
    has_joints: bool


def only_table(grid: Grid) -> Grid:
    """The grid of the one table that was meant, if there are several; those with equal headings are one.

    Raises:
        FileError: several may be meant; it names their lines.
    """
    parts = _parts(grid)
    meant = [part for part in parts if part.has_joints] or [part for part in parts if part.known > 1]
    if len(parts) < 2 or not meant:
        return grid
    heading = grid.rows[meant[0].start]
    if len(parts) == len(meant) and all(grid.rows[part.start] == heading for part in meant):
        again = {part.start for part in meant[1:]}
        kept = [pair for k, pair in enumerate(zip(grid.rows, grid.lines, strict=True)) if k not in again]
        every, at = map(list, zip(*kept, strict=True))
        return replace(grid, rows=every, lines=at, notes=(*grid.notes, "repeated headings are skipped"))
    lines = [f"lines {grid.lines[part.start]}–{grid.lines[part.end - 1]}" for part in meant]
    if len(meant) > 1:
        raise FileError(f"holds several tables ({', '.join(lines)}); keep one of them", path=grid.source)
    note = f"of {len(parts)} tables the one in {lines[0]} is read"
    rows = slice(meant[0].start, meant[0].end)
    return replace(grid, rows=grid.rows[rows], lines=grid.lines[rows], notes=(*grid.notes, note))


def _parts(grid: Grid) -> list[_Part]:
    """Tables begin where text stands above numbers, and two names are known or the width is another."""
    found, width, row = list[_Part](), 0, 0
    for is_text, run in groupby(grid.rows, lambda cells: not any(map(NUMBER.fullmatch, cells))):
        cells = list(run)
        if is_text:
            names = max(cells, key=lambda c: (sum(map(is_known, filter(None, c))), len(c)))
            known = [meaning(parse_heading(cell).name) for cell in names if cell and is_known(cell)]
            below = grid.rows[row + len(cells)] if row + len(cells) < len(grid.rows) else []
            if below and sum(map(bool, names)) > 1 and (len(known) > 1 or len(below) != width):
                width = len(below)
                joints = any(m is not None and m.key[0] == "q" and m.key[1:].isdigit() for m in known)
                found.append(_Part(row + cells.index(names), len(grid.rows), len(known), joints))
                if len(found) > 1:
                    found[-2] = found[-2]._replace(end=row)
        row += len(cells)
    return found

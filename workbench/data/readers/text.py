"""Text tables: encoding, separator, comment lines; every field stays text until its column is known."""

import codecs
import csv
import re
from collections import Counter
from contextlib import suppress
from pathlib import Path

from workbench.base.errors import FileError
from workbench.data.readers.table import NUMBER, Grid, keys_of, with_points

_ENCODINGS = (((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE), "utf-16"), (b"", "utf-8-sig"), (b"", "cp1252"))
"""Byte order marks and name of each, in the order in which they are tried."""
COMMENTS = ("#", "% ", "//")
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", " ": "blanks"}
"""What may part the fields, and what it is called."""
_SAMPLE = 200
"""Lines by which the separator is recognised."""


def read_text(data: bytes, path: Path) -> Grid:
    """Cells of a text table (CSV, TSV, semicolons, blanks)."""
    text, encoding = decode(data, path)
    lines, numbers, comments = list[str](), list[int](), list[str]()
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        bare = line.strip(" \ufeff\x1a")
        line = bare.strip("|") if bare.startswith("|") else line  # as Markdown has it, with a rule
        if bare.startswith(COMMENTS) and not lines:
            comments.append(bare.lstrip("#%/ "))
        elif bare.strip(" \t|:-") and not bare.startswith(COMMENTS):  # `,,` keeps the place of its row
            lines.append(line)
            numbers.append(number)
    if not lines:
        raise FileError("the file holds comments only: a header line and rows are needed", path=str(path))
    separator = separator_of(lines)
    try:
        places, rows = map(list, zip(*fields_of_lines(lines, separator), strict=True))
        above = [row for mark in (separator, " ") for _, row in fields_of_lines(comments[-1:], mark)]
    except csv.Error as error:
        raise FileError(f"the fields can't be separated ({error})", path=str(path)) from None
    numbers = [numbers[place] for place in places]
    filled = max((k for row in rows for k, cell in enumerate(row, 1) if cell), default=0)
    rows = [row[:filled] for row in rows]  # without columns that a separator ends in every row
    width = len(rows[0])
    head = next((a for a in above if len(a) == width or (len(keys_of(a)) > 1 and len(a) < width)), None)
    words = [name for name, cell in zip(head or (), rows[0], strict=False) if not NUMBER.fullmatch(cell)]
    if head and len(words) < len(head) and not {*"xyz"} & {*keys_of(words)}:  # as numpy.savetxt has them
        rows, numbers = [[*head, *["-"] * (width - len(head))], *rows], [numbers[0] - 1, *numbers]
    notes = [f"text in {encoding}"] if encoding != "utf-8-sig" else []
    notes += [f"fields are separated by {SEPARATORS[separator]}"] if separator != "," else []
    told = {"comments": tuple(comments), "notes": tuple(notes)}
    return with_points(Grid(source=str(path), rows=rows, lines=numbers, is_text=True, **told))


def decode(data: bytes, path: Path) -> tuple[str, str]:
    """Text and the name of its encoding: UTF-16 with its mark, UTF-8, else Western European."""
    for mark, name in _ENCODINGS:
        with suppress(UnicodeDecodeError):
            if data.startswith(mark) and not re.search("\0(?![\r\n]|$)", text := data.decode(name)):
                if "Â" in text:
                    with suppress(UnicodeError):
                        text, name = text.encode("cp1252").decode(), "UTF-8 twice"
                return text.replace("\0", ""), name  # zeros that end lines are of strings in C
    wanted = "save the table as CSV in UTF-8"
    raise FileError(f"this is binary, or not text in UTF-8, UTF-16 or Latin-1: {wanted}", path=str(path))


def separator_of(lines: list[str]) -> str:
    """The separator that most lines carry: tab, semicolon, comma, else blanks.

    Of several, the one that parts an earlier line, the heading, into as many fields as most: others stand in
    labels or numbers. Tabs among blanks, all of which part as many fields in every line, are blanks.
    """
    bare = [re.sub(r'"[^"]*"', '""', line).strip(" ") for line in lines[:_SAMPLE]]
    numbers = [k for k, line in enumerate(bare) if re.search(r"\d", line)] or [*range(len(bare))]
    later = numbers[len(numbers) // 2 :]  # titles and headings are apart

    def first(mark: str) -> int:
        counts = [line.count(mark) for line in bare]
        return counts.index(Counter(filter(None, (counts[k] for k in later))).most_common(1)[0][0])

    carried = [mark for mark in "\t;,|" if 2 * sum(mark in bare[k] for k in later) > len(later)]
    mark = min(carried, key=first, default=" ")
    is_even = mark == "\t" and len({len(line.split()) for line in bare if mark in line}) == 1
    cells = [cell.split() for cell in bare[-1].split(mark)] if is_even else []
    return " " if any(len(own) > 1 and all(map(NUMBER.fullmatch, own)) for own in cells) else mark


def fields_of_lines(lines: list[str], separator: str) -> list[tuple[int, list[str]]]:
    """Place of the first line of each row, and its fields, stripped; a quoted one may run over several."""
    if separator == " ":
        joined = (re.sub(r"\s+(?=[\[(])", "", line) for line in lines)  # 'q1 [deg]' is one heading
        return [(place, line.split()) for place, line in enumerate(joined)]
    rows, start = [], 0
    reader = csv.reader((line + "\n" for line in lines), delimiter=separator, skipinitialspace=True)
    for row in reader:
        rows.append((start, [cell.strip() for cell in row]))
        start = reader.line_num
    return rows

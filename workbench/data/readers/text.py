"""Text tables: encoding, separator, comment lines; every field stays text until its column is known."""

import csv
import re
from collections import Counter
from pathlib import Path

from workbench.base.errors import FileError
from workbench.base.remedy import remedy
from workbench.data.readers.arrays import read_json
from workbench.data.readers.file_kind import POSE_PAIRS, TABLE
from workbench.data.readers.table import NUMBER, Grid, Separator

_BOMS = (
    (b"\xef\xbb\xbf", "utf-8-sig"),
    (b"\xff\xfe\x00\x00", "utf-32"),
    (b"\x00\x00\xfe\xff", "utf-32"),
    (b"\xff\xfe", "utf-16"),
    (b"\xfe\xff", "utf-16"),
)
_TWO_NUMBERS = re.compile(r"\d\s+[-+\u2212.\d]")
_TOML = re.compile(r"^\s*(\[\[?[\w.\"' -]+\]\]?\s*(#.*)?$|[\w-]+\s*=\s*[\"\[{\d.+-])", re.MULTILINE)
_YAML = re.compile(r"(---\s*)?(- *\r?\n? *)?[A-Za-z_]\w*:( +[\"']{2})?\r?\n")
"""A first key with nothing beside it."""
_PROGRAM = re.compile(
    r"^\s*(?:def \w+\(|PROC \w+\(|MODULE \w|/PROG\b|/JOB\b|\.PROGRAM\b|PROGRAM \w|&ACCESS|[JL]MOVE \S|PTP \S)"
    r"|\bmove?[jlcp] ?\(|^\s*\d+ ?: *[JLC] +P\[",
    re.IGNORECASE | re.MULTILINE,
)
"""How programs of robots begin, and how they move."""
_SAMPLE = 200
"""Lines by which the separator is recognised."""


def read_text(data: bytes, path: Path) -> Grid:
    """Cells of a text table (CSV, TSV, semicolons, blanks)."""
    text, encoding = decode(data, path)
    if re.match(r"\s*(\{|\[\s*\{)", text):
        return read_json(text, path)
    refuse_other_text(text, path)
    lines, numbers, comments = _significant(text)
    if not lines:
        raise FileError("the file holds comments only: a header line and rows are needed", path=str(path))
    separator = separator_of(lines)
    rows, places = _fields(lines, numbers, separator, path)
    notes = [f"text in {encoding}"] if encoding not in ("utf-8", "utf-8-sig") else []
    if separator is not Separator.COMMA:
        notes.append(f"fields are separated by {separator.text}")
    return Grid(
        source=str(path), rows=rows, lines=places, separator=separator, comments=comments, notes=tuple(notes)
    )


def decode(data: bytes, path: Path) -> tuple[str, str]:
    """Text and the name of its encoding: by byte order mark, by zero bytes, UTF-8, else Western European."""
    for bom, name in _BOMS:
        if data.startswith(bom):
            return _strictly(data, name, path), name
    even, odd = data[:2000:2].count(0), data[1:2000:2].count(0)
    if max(even, odd) > 0.3 * min(len(data), 2000) / 2 and min(even, odd) < 0.1 * max(even, odd):
        name = "utf-16-be" if even > odd else "utf-16-le"
        return _strictly(data, name, path), f"{name} (no byte order mark)"
    try:
        return data.decode("utf-8"), "utf-8"
    except UnicodeDecodeError:
        pass
    try:
        return data.decode("cp1252"), "Latin-1 (not valid UTF-8)"
    except UnicodeDecodeError:
        raise FileError(
            "this is not text in UTF-8, UTF-16 or Latin-1: save the table as UTF-8 CSV", path=str(path)
        ) from None


def _strictly(data: bytes, name: str, path: Path) -> str:
    try:
        return data.decode(name)
    except UnicodeDecodeError as error:
        raise FileError(
            f"it begins like {name} text but is broken at byte {error.start}: save it as UTF-8",
            path=str(path),
        ) from None


def _significant(text: str) -> tuple[list[str], list[int], tuple[str, ...]]:
    """Lines that are neither blank nor comment, their numbers, and the comments before the first of them."""
    lines: list[str] = []
    numbers: list[int] = []
    comments: list[str] = []
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        bare = line.strip(" \ufeff\x1a")
        if bare.startswith("#"):
            if not lines:
                comments.append(bare.lstrip("# "))
        elif bare.strip():
            lines.append(line)
            numbers.append(number)
    return lines, numbers, tuple(comments)


def refuse_other_text(text: str, path: Path) -> None:
    """Raise when a text is plainly another format (XML, URDF, JSON, TOML), or not a text at all."""
    start = text.lstrip()[:4000]
    found = None
    if start.startswith("<"):
        elsewhere = remedy("give it as --robot", page="open it in the Robot tab")
        urdf = f"this is a robot description (URDF): {elsewhere}"
        found = urdf if "<robot" in start else "this is an XML or HTML file"
    elif _YAML.match(start):
        found = f"this is YAML, not a table; {POSE_PAIRS}"
    elif _PROGRAM.search(start):
        found = "this is a robot's program; of programs RAPID, KRL, JBI and URScript are read by 'compensate'"
    elif _is_toml(text, path):
        elsewhere = remedy("give it as --robot or --plate", page="open it in the Robot tab")
        found = f"this is a TOML file, a robot or a plate: {elsewhere}"
    elif min(start, default=" ") < "\t":
        found = "this is a binary file of an unknown kind"
    if found is not None:
        raise FileError(f"{found}; {TABLE}", path=str(path))


def _is_toml(text: str, path: Path) -> bool:
    """Whether most lines are TOML's tables and assignments."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")][:40]
    hits = sum(bool(_TOML.match(line)) for line in lines)
    return hits >= max(1, 0.6 * len(lines)) or (path.suffix.lower() == ".toml" and hits > 0)


def separator_of(lines: list[str]) -> Separator:
    """The separator that most lines carry: tab, semicolon, comma, else blanks.

    Of several, the one that parts an earlier line, the heading, into as many fields as most: others stand in
    labels or numbers. Commas between digits with blanks around the numbers are decimal commas between blanks.
    """
    lines = [re.sub(r'"[^"]*"', '""', line) for line in lines[:_SAMPLE]]
    sample = lines
    if len(sample) > 1:
        sample = sample[-(len(sample) + 1) // 2 :]  # the later half: title and header lines are apart
    carried = {
        separator: [line for line in sample if separator.value in line.strip(" ")]
        for separator in (Separator.TAB, Separator.SEMICOLON, Separator.COMMA)
    }
    carried = {separator: found for separator, found in carried.items() if 2 * len(found) > len(sample)}
    if not carried:
        return Separator.BLANKS
    separator = min(carried, key=lambda one: _first_like(carried[one], one, lines))
    decimal = separator is Separator.COMMA and _commas_are_decimal(carried[separator])
    return Separator.BLANKS if decimal else separator


def _first_like(rows: list[str], separator: Separator, lines: list[str]) -> int:
    """Place of the first line of as many fields as most of the rows have."""
    usual, _ = Counter(line.count(separator.value) for line in rows).most_common(1)[0]
    return next(place for place, line in enumerate(lines) if line.count(separator.value) == usual)


def _commas_are_decimal(lines: list[str]) -> bool:
    """Whether parting at blanks gives numbers, and parting at commas gives two numbers in a field."""
    torn = sum(any(_TWO_NUMBERS.search(part) for part in line.split(",")) for line in lines)
    whole = sum(all(NUMBER.fullmatch(part) for part in line.split()) for line in lines)
    return 2 * torn > len(lines) and 2 * whole > len(lines)


def _fields(
    lines: list[str], numbers: list[int], separator: Separator, path: Path
) -> tuple[list[list[str]], list[int]]:
    """Fields of each row, stripped; a quoted field may run over several lines."""
    if separator is Separator.BLANKS:
        joined = (re.sub(r"\s+(?=[\[(])", "", line) for line in lines)  # 'q1 [deg]' is one heading
        return [line.split() for line in joined], numbers
    rows, places = [], []
    reader = csv.reader((line + "\n" for line in lines), delimiter=separator.value, skipinitialspace=True)
    start = 0
    try:
        for row in reader:
            rows.append([cell.strip() for cell in row])
            places.append(numbers[start])
            start = reader.line_num
    except csv.Error as error:
        raise FileError(
            f"the fields can't be separated ({error})", path=str(path), line=numbers[start]
        ) from None
    return rows, places

"""Lists and numbers in sentences."""

import re
from collections.abc import Iterable, Sequence

MAX_SENTENCE, MAX_QUOTED = 300, 80
"""Characters of a sentence, and of a value that it quotes."""
_OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")
_LONG = re.compile(rf"(?<![\w=])'([^']{{{MAX_QUOTED},}})'")


def span(names: Sequence[str], *, longest: int = 4) -> str:
    """'q1, q2, x', or 'q1 … q6' when there are many."""
    return ", ".join(names) if len(names) <= longest else f"{names[0]} … {names[-1]}"


def ranges(numbers: Sequence[int]) -> str:
    """'2, 3', or '1–4, 6': three or more in a row as a range."""
    runs: list[list[int]] = []
    for number in numbers:
        if not runs or number != runs[-1][-1] + 1:
            runs.append([])
        runs[-1].append(number)
    return ", ".join(f"{r[0]}–{r[-1]}" if len(r) > 2 else ", ".join(map(str, r)) for r in runs)


def joint_list(joints: Sequence[int]) -> str:
    """'joint 3' or 'joints 1–4, 6' of joints that count from 0."""
    return f"joint{'s' if len(joints) > 1 else ''} {ranges([j + 1 for j in joints])}"


def listed(names: Sequence[str], *, longest: int = 8) -> str:
    """The first few names, quoted, and how many more there are."""
    shown = ", ".join(f"'{name}'" for name in names[:longest])
    return shown + (f" and {len(names) - longest} more" if len(names) > longest else "")


def plural(number: int, noun: str) -> str:
    """'1 row', '3 rows'."""
    return f"{number} {noun}" + ("" if number == 1 else "s")


def in_mm(length: float) -> str:
    """A length [m] in three digits, from 100 mm on in whole millimetres; below a micrometre all are alike."""
    if abs(length) < 1e-6:
        return "less than 0.001 mm"
    return f"{1e3 * length:.3g} mm" if abs(length) < 0.1 else f"{1e3 * length:.0f} mm"


def capital(sentence: str) -> str:
    """A sentence that begins with a capital letter, but for a name of a file, an arm or a joint."""
    is_name = any(c.isdigit() or c in "./" for c in sentence.partition(" ")[0].rstrip(".:,;"))
    return sentence if is_name else sentence[:1].upper() + sentence[1:]


def readable(text: str) -> str:
    """Text in which � stands for what a terminal obeys and for what turns the direction of writing.

    A name in a file could otherwise colour, move or hide what is printed behind it.
    """
    return _OBEYED.sub("\N{REPLACEMENT CHARACTER}", text)


def as_cell(text: str) -> str:
    """Text for a cell of a table: `'` before what a spreadsheet would compute; numbers stay as they are.

    `of_cell` takes it off again.
    """
    return f"'{text}" if _begins_formula(text) else text


def of_cell(cell: str) -> str:
    """The text of a cell that `as_cell` wrote."""
    return cell[1:] if cell.startswith("'") and _begins_formula(cell[1:]) else cell


def _begins_formula(text: str) -> bool:
    if not text.lstrip("'").startswith(("=", "+", "-", "@", "\t", "\r")):
        return False
    try:
        float(text)
    except ValueError:
        return True
    return False


def brief(sentence: str) -> str:
    """A sentence as one readable line: long quoted values are shortened, and so is its middle, by words."""
    line = sentence if sentence.isprintable() else "".join(c if c.isprintable() else " " for c in sentence)
    line = _LONG.sub(lambda found: f"'{found[1][: MAX_QUOTED - 20]} …'", line)
    begin, end = line[: MAX_SENTENCE - 103].rsplit(" ", 1)[0], line[-100:].split(" ", 1)[-1]
    return line if len(line) <= MAX_SENTENCE else f"{begin} … {end}"


def first_of(items: Iterable[object], number: int) -> str:
    """The first few of a list, and whether there are more."""
    named = [str(item) for item in items]
    return ", ".join(named[:number]) + (" …" if len(named) > number else "")

"""Robot programs: joint targets read from their text and written back, everything else unchanged.

A motion's target must be a list of numbers, in place or under a name that gets nothing else in the file.
Anything else that moves the arm is refused: a program of which only some targets are corrected is worse than
none. Cartesian targets too: the controller solves them with its own model, which no joint target corrects.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn, final

import numpy as np
from jaxtyping import Float

from workbench.base.errors import FileError
from workbench.base.files import read_bytes, write_bytes
from workbench.data.readers.file_kind import TABLE_ENDINGS
from workbench.data.readers.trajectory import Trajectory

TEXT = "latin-1"
"""Encoding that maps every byte to a character, so that unchanged text is preserved."""
LARGEST = 16 * 2**20
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
BRACKETS = rf"\[\s*{NUMBER}(?:\s*,\s*{NUMBER})*\s*\]"
CARTESIAN = "a Cartesian target or motion, which the controller solves itself"
COMPUTED, DRL = "a joint target that is computed", "Doosan's DRL, which isn't read"
Span = tuple[int, int]


@final
@dataclass(frozen=True, kw_only=True)
class Language:
    """One language, as regular expressions.

    Args:
        name: For people.
        endings: Of its files.
        mark: What tells it in files of other endings.
        unit: Radians in one of its units.
        decimals: Minimum number of decimals written.
        comment: Begin of a comment.
        refused: What moves the arm otherwise, and what that is.
        move: A motion as far as the beginning of its target.
        after: What follows the target.
        literal: A target in numbers.
        value: What a name may get.
        number: Order and text of a number in a literal, as far as its first bracket closes.
        index: What chooses one of several targets under a name.
        here: A target where the arm stands already.
        declared: A joint target that gets a name.
        begin: What precedes a name that gets a value.
        assigned: What follows it.
        end: What follows the value.
    """

    name: str
    endings: tuple[str, ...]
    mark: str
    unit: float = float(np.deg2rad(1.0))
    decimals: int = 4
    comment: str
    refused: tuple[tuple[str, str], ...]
    move: str
    after: str
    literal: str
    value: str = ""
    number: str = rf"()({NUMBER})"
    index: str = r"\[[^\]\n]*\]"
    here: str = r"(?!)"
    declared: str = r"((?!))"
    begin: str = r"(?<![\w$.])"
    assigned: str = r"=(?!=)"
    end: str = r"\n|\Z"

    def targets(self, text: str, path: str) -> Iterator[tuple[Span, ...]]:
        """Start and end of each number of each joint target in the text."""
        blank = lambda m: re.sub(r"[^\n]", " ", m[0])  # noqa: E731
        code = re.sub(rf'"[^"\n]*"|(?:{self.comment})[^\n]*', blank, text.replace("\r", " "))
        for pattern, what in self.refused:
            if found := _pattern(pattern).search(code):
                _fail(code, found.end(), what, path)
        target = _pattern(
            rf"\s*(?:({self.literal})|({self.here})|([$\w]+)\s*(?:{self.index})?)(?=\s*(?:{self.after}))"
        )
        names = {m[1].lower(): m[1] for m in _pattern(self.declared).finditer(code)}
        used, spans = dict[str, int](), set[Span]()
        for move in _pattern(self.move).finditer(code):
            given = target.match(code, move.end()) or _fail(code, move.end(), COMPUTED, path)
            if given[1]:
                spans.add(given.span(1))
            elif given[3]:
                names[given[3].lower()] = given[3]
                used[given[3].lower()] = given.end()
        for key, name in names.items():
            own = self._literals(code, name, path)
            if not own and key in used:
                other = f"'{name}' is not a list of joint positions in this file (give a .dat that has it)"
                _fail(code, used[key], other, path)
            spans |= own
        return (self._numbers(code, *span) for span in sorted(spans))

    def _literals(self, code: str, name: str, path: str) -> set[Span]:
        """Lists of numbers under a name, which may get nothing else."""
        part = rf"(?:\s*(?:{self.index}))?(?:\s*\.\s*(?!e\d|extax)\w+)*"
        gets = _pattern(rf"{self.begin}{re.escape(name)}\b{part}\s*{self.assigned}")
        value = _pattern(rf"\s*(?:{self.value or self.literal})(?=\s*?(?:{self.end}))")
        found = set[Span]()
        for each in gets.finditer(code):
            given = value.match(code, each.end()) or _fail(code, each.end(), f"'{name}' is {COMPUTED}", path)
            found |= {m.span() for m in _pattern(self.literal).finditer(code, *given.span())}
        return found

    def _numbers(self, code: str, begin: int, end: int) -> tuple[Span, ...]:
        """Those of a literal that begins and ends there, in the order of the joints."""
        closed = code.find("]", begin, end)
        found = _pattern(self.number).finditer(code, begin, end if closed < 0 else closed)
        return tuple(m.span(2) for m in sorted(found, key=lambda m: m[1]))


def _pattern(text: str) -> re.Pattern[str]:
    return re.compile(text, re.IGNORECASE | re.MULTILINE)


def _fail(text: str, at: int, what: str, path: str) -> NoReturn:
    raise FileError(f"{what}; make it a joint target in numbers", path=path, line=text.count("\n", 0, at) + 1)


_RAPID = rf"\[\s*{BRACKETS}\s*,\s*{BRACKETS}\s*\]"
PROGRAMS = (
    Language(  # ABB: [[1,2,3,4,5,6],[9E9,…]]; external axes stay
        name="RAPID",
        endings=(".mod", ".modx", ".prg", ".sys", ".sysx"),
        mark=r"^\s*(?:MODULE\s+\w+|(?:LOCAL\s+)?PROC\s+\w+\s*\(|MoveAbsJ\s*\[)",
        comment="!",
        refused=(
            (
                r"\brobtarget\b|\b(?:Move[LCJ](?:Sync|[DAG]O)?|MovePnP|Trigg[LCJ](?:IOs)?|Search[LC]"
                r"|EGM(?:Move[LC]|Run\w+)|Arc[LC]\d?(?:Start|End)?|SpotM?[LJ]|(?:Paint|Disp|Cap|FCPress)[LC])\b"
                r"(?!\s*:=)",
                CARTESIAN,
            ),
        ),
        move=r"\b(?:MoveAbsJ|TriggAbsJ)\b(?:\s*\\\w+(?::=\w+)?\s*,)*",
        after=r"[,\\]",
        literal=_RAPID,
        value=rf"{_RAPID}|\[\s*{_RAPID}(?:\s*,\s*{_RAPID})*\s*\]",
        index=r"\{[^}\n]*\}",
        declared=r"\bjointtarget\s+(\w+)",
        assigned=":=",
        end=";",
    ),
    Language(  # KUKA: {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,E1 0}; external axes stay
        name="KRL",
        endings=(".src", ".dat"),
        mark=r"^\s*(?:&ACCESS\b|(?:GLOBAL\s+)?DEF\s+\w+\s*\([^)\n]*\)(?!\s*:)|S?PTP\s*\{)",
        comment=";|&",
        refused=((r"(?<![\w$#])(?:(?:S?LIN|S?CIRC|SPL|SPLINE)(?:_REL)?|S?PTP_REL|(?:E6)?POS)\b", CARTESIAN),),
        move=r"(?<![\w$#])S?PTP\b",
        after=r"C_\w+|WITH\b|\n|\Z",
        literal=rf"\{{\s*(?:(?:E6)?AXIS\s*:)?\s*A\d\s+{NUMBER}(?:\s*,\s*[AE]\d\s+{NUMBER})*\s*\}}",
        number=rf"A(\d)\s+({NUMBER})",
        here=r"\$(?:AXIS|POS)_ACT(?!\w)",
        declared=r"\b(?:E6)?AXIS\s+(\w+)",
    ),
    Language(  # Universal Robots: movej([…]), in place or by the name of a list
        name="URScript",
        endings=(".script", ".urscript"),
        mark=r"^\s*(?:def\s+\w+\(.*\):|(?:move[jlp]|servo[jc])\s*\()",
        unit=1.0,
        decimals=6,
        comment="#",
        refused=((r"\bpos[jx]\(", DRL), (r"\b(?:movec|optimove[jl]|move[jlp]\s*\(\s*p\s*\[)", CARTESIAN)),
        move=r"\b(?:move[jlp]|servo[jc])\s*\((?:\s*(?:q|pose)\s*=)?",
        after=r"[,)]",
        literal=BRACKETS,
        begin=r"^[ \t]*(?:(?:global|local)\s+)?",
    ),
)


@dataclass(frozen=True, eq=False)
class Program:
    """A program with its joint targets.

    Args:
        spans: Start and end of each number in the text, one row per target.
        q: The targets [rad].
    """

    text: str
    language: Language
    spans: tuple[tuple[Span, ...], ...]
    q: Float[np.ndarray, "targets n"]
    source: str

    @property
    def trajectory(self) -> Trajectory:
        """The targets as a list of poses."""
        return Trajectory(time=None, q=self.q, position=None, rotation=None, source=self.source, notes=())

    @property
    def lines(self) -> list[int]:
        """The line of each target, counted from 1."""
        return [self.text.count("\n", 0, row[0][0]) + 1 for row in self.spans]

    def save(self, q: Float[np.ndarray, "targets n"], path: Path) -> Path:
        """Write the program with other joint targets, and everything else unchanged."""
        places = [span for row in self.spans for span in row]
        text, at, values = [], 0, (q / self.language.unit).ravel().tolist()
        for (begin, end), value in sorted(zip(places, values, strict=True)):
            shown = len(self.text[begin:end].partition(".")[2])
            text += [self.text[at:begin], f"{value:.{max(shown, self.language.decimals)}f}"]
            at = end
        return write_bytes(path, "".join([*text, self.text[at:]]).encode(TEXT))


def read_program(path: Path, joints: int) -> Program | None:
    """A program, by its file extension, or else by its text; None for other files."""
    ending = path.suffix.lower()
    if ending in {*TABLE_ENDINGS} - {".txt"} or not path.is_file() or path.stat().st_size > LARGEST:
        return None
    text = read_bytes(path, wanted="a table or a program", maximum=LARGEST).decode(TEXT)
    named = (f for f in PROGRAMS if ending in f.endings or _pattern(f.mark).search(text))
    if (language := next(named, None)) is None:
        return None
    spans = sorted(language.targets(text, str(path)))
    if not spans:
        raise FileError(f"contains no joint target in {language.name}; check the language", path=str(path))
    for row in (row for row in spans if len(row) != joints):
        what = f"a target of {len(row)} joints, but the robot has {joints}"
        raise FileError(what, path=str(path), line=text[: row[0][0]].count("\n") + 1)
    q = np.array([[float(text[a:b]) for a, b in row] for row in spans]) * language.unit
    return Program(text, language, tuple(spans), q, str(path))

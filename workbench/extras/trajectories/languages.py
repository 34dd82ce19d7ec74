"""RAPID, KRL, JBI and URScript: where joint targets stand in them, and what is refused.

A motion's target must be a list of numbers, in place or under a name that gets nothing else in the file.
Anything else that moves the arm is refused: a program of which only some targets are corrected is worse than
none. Cartesian targets too: the controller solves them with its own model, which no joint target corrects.
"""

import re
from abc import abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, NoReturn, final

import numpy as np

from workbench.base.errors import FileError
from workbench.base.files import read_bytes
from workbench.extras.trajectories.programs import TEXT, AbstractProgramFormat, Program

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
LIST = rf"\s*{NUMBER}\s*(?:,\s*{NUMBER}\s*)*"
DEGREE = float(np.deg2rad(1.0))
CARTESIAN = "a Cartesian target or motion, which the controller solves itself"
COMPUTED = "a joint target that is computed"

Spans = list[tuple[int, int]]


def _without(text: str, comment: str) -> str:
    """The text with blanks in place of comments and strings."""
    blank = lambda m: re.sub(r"[^\n]", " ", m[0])  # noqa: E731
    return re.sub(rf'"[^"\n]*"|(?:{comment})[^\n]*', blank, text)


def _fail(text: str, at: int, what: str, path: str) -> NoReturn:
    raise FileError(f"{what}; make it a joint target in numbers", path=path, line=text.count("\n", 0, at) + 1)


def _numbers(text: str, begin: int, end: int) -> Spans:
    return [m.span() for m in re.compile(NUMBER).finditer(text, begin, end)]


def _pattern(text: str) -> re.Pattern[str]:
    return re.compile(text, re.IGNORECASE | re.MULTILINE)


def _refuse(text: str, pattern: str, what: str, path: str) -> None:
    if found := _pattern(pattern).search(text):
        _fail(text, found.end(), what, path)


class AbstractLanguage(AbstractProgramFormat):
    """A language whose motions have joint targets in place or by name, as regular expressions.

    `move` ends where a target begins, `after` follows it, `literal` is one in numbers, `index` chooses one
    of a list, `here` is where the arm stands; `declared` precedes the name of a joint target, `begin` a
    name that gets a value, `assigned` the value, and `end` follows it.
    """

    unit: ClassVar[float] = DEGREE
    decimals: ClassVar[int] = 4
    comment: ClassVar[str]
    refused: ClassVar[str]
    move: ClassVar[str]
    after: ClassVar[str]
    literal: ClassVar[str]
    index: ClassVar[str] = r"\[[^\]\n]*\]"
    here: ClassVar[str] = r"(?!)"
    declared: ClassVar[str] = r"(?!)"
    begin: ClassVar[str] = r"(?<![\w$.])"
    assigned: ClassVar[str] = r"=(?!=)"
    end: ClassVar[str] = r"\n|\Z"

    def targets(self, text: str, path: str) -> Iterator[Spans]:
        code = _without(text, self.comment)
        _refuse(code, self.refused, CARTESIAN, path)
        target = _pattern(
            rf"\s*(?:({self.literal})|({self.here})|([$\w]+)\s*(?:{self.index})?)(?=\s*(?:{self.after}))"
        )
        names = {m[1].lower(): m for m in _pattern(rf"{self.declared}\s+(\w+)").finditer(code)}
        found = set[tuple[int, int]]()
        for move in _pattern(self.move).finditer(code):
            given = target.match(code, move.end()) or _fail(code, move.end(), COMPUTED, path)
            if given[1]:
                found.add(given.span(1))
            elif given[3]:
                names[given[3].lower()] = given
        for use in names.values():
            name = use[use.lastindex or 0]
            own = self._literals(code, name, path)
            if not own and use.re is target:
                _fail(code, use.end(), f"'{name}' is not a list of joint positions in this file", path)
            found |= own
        return (self._numbers(code, *span) for span in sorted(found))

    def _literals(self, code: str, name: str, path: str) -> set[tuple[int, int]]:
        """Lists of numbers under a name, which may get nothing else."""
        part = rf"(?:\s*(?:{self.index}))?(?:\s*\.\s*(?!e\d|extax)\w+)*"
        gets = _pattern(rf"{self.begin}{re.escape(name)}\b{part}\s*{self.assigned}")
        several = rf"\s*\[?\s*{self.literal}(?:\s*,\s*{self.literal})*\s*\]?"
        value, one = _pattern(rf"{several}(?=\s*?(?:{self.end}))"), _pattern(self.literal)
        found = set[tuple[int, int]]()
        for each in gets.finditer(code):
            given = value.match(code, each.end()) or _fail(code, each.end(), f"'{name}' is {COMPUTED}", path)
            found |= {m.span() for m in one.finditer(code, *given.span())}
        return found

    @abstractmethod
    def _numbers(self, code: str, begin: int, end: int) -> Spans:
        """Those of a literal that begins and ends there."""


@final
class Rapid(AbstractLanguage):
    """ABB: `[[1,2,3,4,5,6],[9E9,…]]` in degrees; external axes stay."""

    name = "RAPID"
    endings: ClassVar[tuple[str, ...]] = (".mod", ".modx", ".prg", ".sys", ".sysx")
    comment = "!"
    refused = (
        r"\brobtarget\b|\b(?:Move[LCJ](?:Sync|[DAG]O)?|MovePnP|Trigg[LCJ](?:IOs)?|Search[LC]|EGM(?:Move[LC]|Run\w+)"
        r"|Arc[LC]\d?(?:Start|End)?|SpotM?[LJ]|(?:Paint|Disp|Cap|FCPress)[LC])\b(?!\s*:=)"
    )
    move = r"\b(?:MoveAbsJ|TriggAbsJ)\b(?:\s*\\\w+(?::=\w+)?\s*,)*"
    after = r"[,\\]"
    literal = rf"\[\s*\[{LIST}\]\s*,\s*\[{LIST}\]\s*\]"
    index = r"\{[^}\n]*\}"
    declared = r"\bjointtarget"
    assigned = ":="
    end = ";"

    def _numbers(self, code: str, begin: int, end: int) -> Spans:
        return _numbers(code, begin, code.index("]", begin))


@final
class Krl(AbstractLanguage):
    """KUKA: `{A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,E1 0}` in degrees; external axes stay."""

    name = "KRL"
    endings: ClassVar[tuple[str, ...]] = (".src", ".dat")
    comment = ";|&"
    refused = r"(?<![\w$#])(?:S?LIN|S?CIRC|SPL|SPLINE)(?:_REL)?\b|(?<![\w$#])(?:S?PTP_REL|(?:E6)?POS)\b"
    move = r"(?<![\w$#])S?PTP\b"
    after = r"C_\w+|WITH\b|\n|\Z"
    literal = rf"\{{\s*(?:(?:E6)?AXIS\s*:)?\s*A\d\s+{NUMBER}(?:\s*,\s*[AE]\d\s+{NUMBER})*\s*\}}"
    here = r"\$(?:AXIS|POS)_ACT(?!\w)"
    declared = r"\b(?:E6)?AXIS"

    def _numbers(self, code: str, begin: int, end: int) -> Spans:
        axes = _pattern(rf"A(\d)\s+({NUMBER})").finditer(code, begin, end)
        return [m.span(2) for m in sorted(axes, key=lambda m: m[1])]


@final
class UrScript(AbstractLanguage):
    """Universal Robots: `movej([…])` in radians, in place or by the name of a list."""

    name = "URScript"
    endings: ClassVar[tuple[str, ...]] = (".script", ".urscript")
    unit, decimals = 1.0, 6
    comment = "#"
    refused = r"\b(?:movec|optimove[jl]|move[jlp]\s*\(\s*p\s*\[)"
    move = r"\b(?:move[jlp]|servo[jc])\s*\((?:\s*(?:q|pose)\s*=)?"
    after = r"[,)]"
    literal = rf"\[{LIST}\]"
    begin = r"^[ \t]*(?:(?:global|local)\s+)?"

    def _numbers(self, code: str, begin: int, end: int) -> Spans:
        return _numbers(code, begin, end)


@final
class Jbi(AbstractProgramFormat):
    """Yaskawa: `C00001=1.0,2.0,…` in degrees under `///POSTYPE ANGLE`; base and external axes stay."""

    name = "JBI"
    endings: ClassVar[tuple[str, ...]] = (".jbi",)
    unit, decimals = DEGREE, 4

    def targets(self, text: str, path: str) -> Iterator[Spans]:
        code = _without(text.replace("\r", " "), "'")
        pulses = "positions in pulses, whose size the file does not say: convert to ANGLE"
        _refuse(code, r"^///(?:POSTYPE\s+)?PULSE", pulses, path)
        _refuse(code, r"^///POSTYPE\s+(?!ANGLE)|\b(?:IMOV|SFTON)\b", CARTESIAN, path)
        _refuse(code, r"^///GROUP2\s+RB", "targets of two robots", path)
        _refuse(code, r"\bMOV[JLCS]\s+(?!C\d)", "a position variable, which the controller holds", path)
        header = re.search(r"^///POSTYPE\s+ANGLE", code, re.MULTILINE)
        known = set[str]()
        for found in re.finditer(r"^C(\d+)[ ]*=(.*)", code, re.MULTILINE):
            if header is None or header.start() > found.start():
                _fail(
                    code,
                    found.start(),
                    "a position of unknown kind, as no ///POSTYPE ANGLE precedes it",
                    path,
                )
            if not re.fullmatch(LIST, found[2]):
                _fail(code, found.start(), "a position that can't be read", path)
            known.add(found[1])
            yield _numbers(code, *found.span(2))
        for move in re.finditer(r"\bMOV[JLCS]\s+C(\d+)", code):
            if move[1] not in known:
                _fail(code, move.start(), f"C{move[1]} is not in this file", path)


PROGRAMS: tuple[AbstractProgramFormat, ...] = (Rapid(), Krl(), Jbi(), UrScript())
LARGEST = 16 * 2**20


def read_program(path: Path, joints: int) -> Program | None:
    """A program, by its file extension; None for other files."""
    form = next((f for f in PROGRAMS if path.suffix.lower() in f.endings), None)
    if form is None:
        return None
    text = read_bytes(path, wanted=f"a {form.name} program", maximum=LARGEST).decode(TEXT)
    spans = sorted(tuple(row) for row in form.targets(text, str(path)))
    if not spans:
        raise FileError(f"contains no joint target in {form.name}; check the language", path=str(path))
    for row in spans:
        if len(row) != joints:
            line = text.count("\n", 0, row[0][0]) + 1
            raise FileError(
                f"a target of {len(row)} joints, but the robot has {joints}", path=str(path), line=line
            )
    q = np.array([[float(text[a:b]) for a, b in row] for row in spans]) * form.unit
    return Program(text, form, tuple(spans), q, str(path))

"""RAPID, KRL, JBI and URScript: where joint targets stand in them, and what is refused.

Cartesian targets are refused: the controller solves them with its own model, which no joint target corrects.
"""

import re
from collections.abc import Iterator
from typing import ClassVar, final

import numpy as np

from workbench.base.errors import FileError
from workbench.paths.programs import AbstractProgramFormat

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
LIST = rf"\s*{NUMBER}\s*(?:,\s*{NUMBER}\s*)*"
DEGREE = float(np.deg2rad(1.0))


def _numbers(text: str, begin: int, end: int) -> list[tuple[int, int]]:
    return [(begin + m.start(), begin + m.end()) for m in re.finditer(NUMBER, text[begin:end])]


def _without(text: str, comment: str) -> str:
    """The text with blanks in place of comments and strings."""
    blank = lambda m: re.sub(r"[^\n]", " ", m[0])  # noqa: E731
    return re.sub(rf'"[^"\n]*"|(?:{comment})[^\n]*', blank, text)


def _refuse(text: str, pattern: str, what: str, path: str) -> None:
    if found := re.search(pattern, text, re.IGNORECASE | re.MULTILINE):
        line = text.count("\n", 0, found.start()) + 1
        raise FileError(f"{what}; make it a joint target", path=path, line=line)


@final
class Rapid(AbstractProgramFormat):
    """ABB: `[[1,2,3,4,5,6],[9E9,…]]` in degrees."""

    name = "RAPID"
    endings: ClassVar[tuple[str, ...]] = (".mod", ".modx", ".prg")
    unit, decimals = DEGREE, 4

    def targets(self, text: str, path: str) -> Iterator[list[tuple[int, int]]]:
        code = _without(text, "!")
        _refuse(
            code,
            r"\brobtarget\b|\bMove[LC]\b",
            "a Cartesian target, which the controller solves itself",
            path,
        )
        found = list(re.finditer(rf"\[\s*\[({LIST})\]\s*,\s*\[{LIST}\]\s*\]", code))
        if len(re.findall(r"\bjointtarget\b[^;\n]*:=", code, re.IGNORECASE)) > len(found):
            _refuse(code, r"\bjointtarget\b[^;\n]*:=", "a joint target that is computed", path)
        return (_numbers(text, *m.span(1)) for m in found)


@final
class Krl(AbstractProgramFormat):
    """KUKA: `{A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,E1 0}` in degrees; external axes stay."""

    name = "KRL"
    endings: ClassVar[tuple[str, ...]] = (".src", ".dat")
    unit, decimals = DEGREE, 4

    def targets(self, text: str, path: str) -> Iterator[list[tuple[int, int]]]:
        code = _without(text, ";(?!FOLD)|;FOLD|&")
        _refuse(
            code,
            r"\{\s*(?:E6POS:|POS:|FRAME:)?\s*X\s",
            "a Cartesian target, which the controller solves itself",
            path,
        )
        _refuse(
            code,
            r"\b(?:LIN|CIRC|SPL|SLIN|SCIRC)\b",
            "a Cartesian motion, which the controller solves itself",
            path,
        )
        for found in re.finditer(r"\{[^{}\n]*\bA1\s[^{}\n]*\}", code):
            axes = list(re.finditer(rf"\bA(\d)\s+({NUMBER})(?=\s*[,}}])", found[0]))
            if [int(m[1]) for m in axes] != list(range(1, len(axes) + 1)) or len(axes) != len(
                re.findall(r"\bA\d\b", found[0])
            ):
                _refuse(code[: found.end()], re.escape(found[0]), "a joint target that is computed", path)
            yield [(found.start() + m.start(2), found.start() + m.end(2)) for m in axes]


@final
class Jbi(AbstractProgramFormat):
    """Yaskawa: `C00001=1.0,2.0,…` in degrees under `///POSTYPE ANGLE`."""

    name = "JBI"
    endings: ClassVar[tuple[str, ...]] = (".jbi",)
    unit, decimals = DEGREE, 4

    def targets(self, text: str, path: str) -> Iterator[list[tuple[int, int]]]:
        _refuse(
            text,
            r"^///POSTYPE\s+PULSE|^///PULSE",
            "positions in pulses, whose size the file does not say: convert to ANGLE",
            path,
        )
        _refuse(
            text, r"^///POSTYPE\s+(?!ANGLE)", "a Cartesian position, which the controller solves itself", path
        )
        for found in re.finditer(rf"^B?C\d+=({LIST})$", text.replace("\r", " "), re.MULTILINE):
            yield _numbers(text, *found.span(1))


@final
class UrScript(AbstractProgramFormat):
    """Universal Robots: `movej([…])` in radians, in place or by the name of a list."""

    name = "URScript"
    endings: ClassVar[tuple[str, ...]] = (".script", ".urscript")
    unit, decimals = 1.0, 6

    def targets(self, text: str, path: str) -> Iterator[list[tuple[int, int]]]:
        code = _without(text, "#")
        _refuse(code, r"\bp\s*\[", "a pose, which the controller solves itself", path)
        moves = re.findall(r"\b(?:move[jlpc]|servo[jc])\s*\(\s*([^,)\[]+|\[[^\]]*\])", code)
        for argument in moves:
            literal = argument if argument[0] == "[" else rf"{argument.strip()} = […]"
            is_name = re.fullmatch(r"\w+", argument.strip())
            known = is_name and re.search(rf"\b{argument.strip()}\s*=\s*\[{LIST}\]", code)
            if not known and not re.fullmatch(rf"\[{LIST}\]", argument):
                _refuse(code, re.escape(argument), f"'{literal}' is computed", path)
        names = "|".join(sorted({re.escape(a.strip()) for a in moves if a[0] != "["})) or "(?!)"
        begin = rf"(?:\b(?:move[jlpc]|servo[jc])\s*\(\s*|\b(?:{names})\s*=\s*)"
        return (_numbers(text, *m.span(1)) for m in re.finditer(rf"{begin}\[({LIST})\]", code))

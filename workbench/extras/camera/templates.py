"""What is made from a board: the sheet to print, and the files that a folder of its pictures needs."""

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError
from workbench.base.files import write_text
from workbench.extras.camera.camera import ON, Mount
from workbench.extras.camera.corner_detection import Finder
from workbench.extras.camera.folder import has_target
from workbench.extras.camera.likely_board import likely_board
from workbench.extras.camera.picture_files import ENDINGS, read_picture, readable
from workbench.extras.camera.printed import board_sheet
from workbench.extras.camera.target import Charuco, charuco_target, target_toml

DICTIONARY = "DICT_6X6_250"
"""Of the markers that are printed."""
LOOKED_AT = 12
"""Pictures in which squares are counted."""
NO_TARGET = "no target.toml"
"""How the note of a board begins of which no file tells."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board as somebody prints it.

    Args:
        across: Squares across …
        down: … and down.
        square: Side of a square [m].
        mounted: What carries it: `tool` or `world`; the other one carries the camera.
    """

    across: int = 5
    down: int = 7
    square: float = 0.036
    mounted: Mount = Mount.TOOL

    @property
    def charuco(self) -> Charuco:
        return Charuco((self.across, self.down), self.square, fitting_marker(self.square), DICTIONARY)

    def pdf(self) -> bytes:
        """The sheet to print at its true size."""
        return board_sheet(self.charuco).pdf()

    def target(self) -> str:
        """Its `target.toml`."""
        return target_toml(charuco_target(self.charuco, self.mounted))

    def folder(self, robot: Robot) -> bytes:
        """A ZIP to which pictures are added: `target.toml`, `joints.csv`."""
        units = ("mm" if slides else "deg" for slides in sliding(robot))
        heads = ",".join(["image", *(f"q{k}[{unit}]" for k, unit in enumerate(units, 1))])
        files = {"target.toml": self.target(), "joints.csv": f"{heads}\n"}
        made = io.BytesIO()
        with zipfile.ZipFile(made, "w") as archive:
            for name, text in files.items():
                archive.writestr(name, text)
        return made.getvalue()

    def fill_in(self, folder: Path) -> tuple[str, ...]:
        """Write `target.toml` in a folder of pictures without; returns what was done, a sentence each."""
        files = [("", p) for p in sorted(folder.rglob("*")) if p.suffix.lower() in ENDINGS]
        if has_target(folder) or not files:
            return ()
        some = [files[k] for k in np.unique(np.linspace(0, len(files) - 1, LOOKED_AT).astype(int))]
        pictures = list(readable(some, {"": None})) or [read_picture(some[0][1])]  # which says why it can't
        if (board := likely_board(self.charuco, pictures)) is None:
            reason = Finder.of(charuco_target(self.charuco, self.mounted)).reason(pictures[0])
            raise DataError(
                "the pictures don't tell how many squares the board has; add its target.toml. Of the first "
                f"picture: {reason}"
            )
        write_text(folder / "target.toml", target_toml(charuco_target(board, self.mounted)))
        counted = "{} × {} squares counted in the pictures".format(*board.squares)
        return (f"{NO_TARGET}: {counted} ({board.dictionary}), of {self._side_and_place}",)

    @property
    def question(self) -> str:
        """Asks for what pictures don't tell."""
        return f"Is it a board with squares of {self._side_and_place}? They are counted in the pictures."

    @property
    def _side_and_place(self) -> str:
        return f"{1e3 * self.square:g} mm, {ON[self.mounted]}"


def fitting_marker(square: float) -> float:
    """Side of the markers in squares of this side [m]."""
    return round(0.75 * square, 4)


def across_down(text: str) -> tuple[int, int]:
    """Squares across and down from 5x7."""
    try:
        across, down = (int(part) for part in text.lower().replace("×", "x").split("x"))
    except ValueError:
        raise OptionError(f"squares must be like 5x7, got '{text}'") from None
    return across, down

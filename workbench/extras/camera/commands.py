"""Commands of cameras, board and handeye, and the options of measurements from pixels."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast, final

import workbench as wb
from workbench.base.errors import OptionError
from workbench.base.files import check_ending, write_bytes, write_text
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.option_records import AbstractSource
from workbench.cli.options import argument, option

if TYPE_CHECKING:
    from workbench.arm.robot import Robot
    from workbench.data.dataset import Dataset


@in_section("Calibrate")
def board(
    out: Annotated[Path, option("Write the sheet here, a .pdf to print.")],
    squares: Annotated[str, option("Squares across x down.")] = "5x7",
    square: Annotated[str, option("Side of a square.")] = "36mm",
    marker: Annotated[str | None, option("Side of a marker; chosen to fit the squares if not given.")] = None,
    dictionary: Annotated[str, option("Dictionary of the markers.")] = "DICT_6X6_250",
    mounted: Annotated[str, option("Where it will be mounted: tool or world.")] = "tool",
) -> None:
    """A ChArUco board to print at true size, and its target.toml."""
    from workbench.extras.camera.camera import Mount
    from workbench.extras.camera.corner_detection import board_pdf
    from workbench.extras.camera.target import Charuco, charuco_target, target_toml

    check_ending(out, "a board is", ".pdf")
    mount = opt.choice_of({str(m): m for m in Mount}, mounted, "--mounted")
    side = opt.quantity(square, "square")
    inner = round(0.75 * side, 4) if marker is None else opt.quantity(marker, "marker")
    printed, beside = Charuco(cast(Any, squares), side, inner, dictionary), out.parent / "target.toml"
    opt.check_writable(out, beside)
    text, (pdf, title) = target_toml(charuco_target(printed, mount)), board_pdf(printed)
    if beside.exists() and beside.read_text(encoding="utf-8") != text:
        raise OptionError(f"{beside} describes another target; write --out into another folder, or move it")
    opt.say(f"{title}: {write_bytes(out, pdf)}")
    opt.say(f"target: {write_text(beside, text)}")
    opt.write_result({"schema": "workbench.board/1", "sheet": str(out), "target": str(beside)})


@in_section("Calibrate")
def handeye(
    pairs: Annotated[
        list[Path],
        argument(
            "Pairs of the robot's pose and the target's in the camera: samples of easy_handeye or MoveIt, a "
            "table, OpenCV's or NumPy's arrays, a folder of numbered files; or the robot's and the target's."
        ),
    ],
    mounted: Annotated[
        str | None, option("What carries the camera: tool or world; default: as the pairs fit.")
    ] = None,
    save: Annotated[
        Path | None, option("Write the camera's pose here (.yaml as easy_handeye, .urdf a joint, .toml).")
    ] = None,
) -> None:
    """Camera on the hand or in the cell, and its target, from pairs of robot and target poses."""
    from workbench.extras.camera.hand_eye import ENDINGS

    if save is not None:
        check_ending(save, "a camera's pose is", *ENDINGS)
    opt.check_writable(save)
    if len(pairs) > 2:
        raise OptionError(f"give a file or folder, or the robot's and the target's, not {len(pairs)} of them")
    found = wb.handeye(pairs, mounted=mounted)
    opt.give(found, found.doubt, save, saved="camera")


@final
@dataclass(frozen=True)
class PixelSource(AbstractSource):
    """Corners in a table, or pictures in a folder."""

    target: Annotated[Path | None, option("Data are pixels: the board or tags seen, a target.toml.")] = None
    camera: Annotated[
        Path | None, option("With --target: the cameras (camera.toml); by default they are identified.")
    ] = None

    def read(self, path: Path, arm: "Robot", joints: Path | None) -> "Dataset | None":
        if self.target is None:
            if self.camera is not None:
                raise OptionError("--camera needs --target FILE: the board or tags in view")
            return None
        from workbench.extras.camera.folder import read_folder, unpacked
        from workbench.extras.camera.pixel_table import read_pixels
        from workbench.extras.camera.rig import read_rig

        rig, is_packed = read_rig(self.camera, self.target), path.is_file() and path.suffix.lower() == ".zip"
        if not (is_packed or path.is_dir()):
            return read_pixels(path, rig, joints=joints, dof=arm)
        with unpacked(path.name, path.read_bytes()) if is_packed else nullcontext(path) as folder:
            return replace(read_folder(folder, rig=rig, joints=joints, dof=arm), source=str(path))

"""Commands of cameras: board, handeye."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import argument, option


@in_section("Calibrate")
def board(
    out: Annotated[Path, option("Write the sheet here (.pdf to print, or .png).")],
    squares: Annotated[str, option("Squares across x down.")] = "5x7",
    square: Annotated[str, option("Side of a square.")] = "36mm",
    marker: Annotated[str | None, option("Side of a marker; chosen to fit the squares if not given.")] = None,
    dictionary: Annotated[str, option("Dictionary of the markers.")] = "DICT_6X6_250",
    mounted: Annotated[str, option("Where it will be mounted: tool or world.")] = "tool",
    boards: Annotated[int, option("Number of boards with different markers, for one arm and camera.")] = 1,
    dpi: Annotated[float, option("Resolution of a .png [dots per inch].")] = 300.0,
) -> None:
    """A ChArUco board to print at true size, and its target.toml."""
    from workbench.base.files import write_bytes, write_text
    from workbench.extras.camera.camera import Mount
    from workbench.extras.camera.printed import PrintedSheet, across_down, fitting_marker
    from workbench.extras.camera.target import Charuco, charuco_target, target_toml

    if out.suffix.lower() not in (".pdf", ".png"):
        raise OptionError(f"--out must end in .pdf or .png, got '{out}'")
    if mounted not in tuple(Mount):
        raise OptionError(f"--mounted must be tool or world, got '{mounted}'")
    if boards < 1:
        raise OptionError(f"--boards must be at least 1, got {boards}")
    if not 30.0 <= dpi <= 1200.0:
        raise OptionError(f"--dpi must be 30–1200, got {dpi:g}")
    side, (across, down) = opt.length(square), across_down(squares)
    inner = fitting_marker(side) if marker is None else opt.length(marker)
    beside = out.parent / "target.toml"
    paths = [out] if boards == 1 else [out.with_stem(f"{out.stem}-{k}") for k in range(1, boards + 1)]
    opt.check_writable(*paths, beside)
    targets, sheets = [], []
    for k in range(boards):
        name = f"board{k + 1}" if boards > 1 else ""
        board = Charuco((across, down), side, inner, dictionary, k * (across * down // 2))
        targets.append(charuco_target(board, mounted, name=name, first=k * (across - 1) * (down - 1)))
        sheets.append(PrintedSheet.of(board))
    text = target_toml(*targets)
    if beside.exists() and beside.read_text(encoding="utf-8") != text:
        raise OptionError(f"{beside} describes another target; write --out into another folder, or move it")
    for path, sheet in zip(paths, sheets, strict=True):
        content = sheet.pdf() if out.suffix.lower() == ".pdf" else sheet.png(dpi)
        opt.say(f"{sheet.title} on {sheet.paper[0]}: {write_bytes(path, content)}")
    opt.say(f"target: {write_text(beside, text)}")


@in_section("Calibrate")
def handeye(
    pairs: Annotated[
        Path,
        argument(
            "Pairs of the robot's pose and the target's in the camera: samples of easy_handeye or MoveIt "
            "(YAML), a table with both in a row (CSV), or OpenCV's arrays (.npz)."
        ),
    ],
    mounted: Annotated[
        str | None, option("What carries the camera: tool or world; default: as the pairs fit.")
    ] = None,
    save: Annotated[
        Path | None, option("Write the camera's pose here (.yaml as easy_handeye, .urdf a joint, .toml).")
    ] = None,
    json: opt.JsonOption = None,
) -> None:
    """Camera on the hand or in the cell, and its target, from pairs of robot and target poses."""
    from workbench.base.files import check_ending
    from workbench.extras.camera.camera import Mount
    from workbench.extras.camera.hand_eye import ENDINGS

    mount = None if mounted is None else opt.choice_of({str(m): m for m in Mount}, mounted, "--mounted")
    if save is not None:
        check_ending(save, "a camera's pose is", *ENDINGS)
    opt.check_writable(save, json)
    found = wb.handeye(pairs, mounted=mount)
    opt.give(found, json)
    if found.doubt:
        opt.fail(found.doubt + (f"; {save} is not written" if save is not None else ""))
    if save is not None:
        opt.say(f"camera: {found.save(save)}")

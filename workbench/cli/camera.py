"""The command for cameras: board."""

from pathlib import Path
from typing import Annotated

from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.options import option


def board(
    out: Annotated[Path, option("Write the sheet here (.pdf to print, or .png).")],
    squares: Annotated[str, option("Squares across x down.")] = "5x7",
    square: Annotated[str, option("Side of a square; for a solid, length of its edges.")] = "36mm",
    marker: Annotated[str | None, option("Side of a marker; chosen to fit the squares if not given.")] = None,
    dictionary: Annotated[str, option("Dictionary of the markers.")] = "DICT_6X6_250",
    shape: Annotated[str, option("board, or tags on a cube or dodecahedron.")] = "board",
    mounted: Annotated[str, option("Where it will be mounted: tool or world.")] = "tool",
    boards: Annotated[int, option("Number of boards with different markers, for one arm and camera.")] = 1,
    dpi: Annotated[float, option("Resolution of a .png [dots per inch].")] = 300.0,
) -> None:
    """A ChArUco board (or a polyhedron of tags) to print at true size, and its target.toml."""
    from workbench.base.files import write_bytes
    from workbench.data.camera.camera import Mount
    from workbench.data.camera.polyhedron import Shape, tag_solid
    from workbench.data.camera.printed import board_sheet
    from workbench.data.camera.target import Charuco, charuco_target, target_toml, write_target

    if out.suffix.lower() not in (".pdf", ".png"):
        raise OptionError(f"--out must end in .pdf or .png, got '{out}'")
    if mounted not in tuple(Mount):
        raise OptionError(f"--mounted must be tool or world, got '{mounted}'")
    if shape not in ("board", *Shape):
        raise OptionError(f"--shape must be board, {', '.join(Shape)}, got '{shape}'")
    if boards < 1:
        raise OptionError(f"--boards must be at least 1, got {boards}")
    if not 30.0 <= dpi <= 1200.0:
        raise OptionError(f"--dpi must be 30–1200, got {dpi:g}")
    side = opt.length(square)
    tag = None if marker is None else opt.length(marker)
    beside = out.parent / "target.toml"
    paths = [out] if boards == 1 else [out.with_stem(f"{out.stem}-{k}") for k in range(1, boards + 1)]
    opt.check_writable(*paths, beside)
    across, down = _across_down(squares)
    inner = round(0.75 * side, 4) if tag is None else tag
    made, sheets = [], []
    for k in range(boards):
        name = f"board{k + 1}" if boards > 1 else ""
        if shape == "board":
            board = Charuco((across, down), side, inner, dictionary, k * (across * down // 2))
            first = k * (across - 1) * (down - 1)
            target, sheet = charuco_target(board, mounted, name=name, first=first), board_sheet(board)
        else:
            target, sheet = tag_solid(
                shape, side, tag=tag, dictionary=dictionary, mounted=mounted, number=k + 1, name=name
            )
        made.append(target)
        sheets.append(sheet)
    targets = tuple(made)
    if beside.exists() and beside.read_text(encoding="utf-8") != target_toml(targets):
        raise OptionError(f"{beside} describes another target; write --out into another folder, or move it")
    for path, sheet in zip(paths, sheets, strict=True):
        content = sheet.pdf() if out.suffix.lower() == ".pdf" else sheet.png(dpi)
        opt.say(f"{sheet.title} on {sheet.paper[0]}: {write_bytes(path, content)}")
    opt.say(f"target: {write_target(targets, beside)}")


def _across_down(text: str) -> tuple[int, int]:
    """Squares across and down from 5x7."""
    try:
        across, down = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise OptionError(f"--squares must be like 5x7, got '{text}'") from None
    return across, down


def view_of(camera: Path, target: Path | None, places: list[str], target_at: str, depth: str | None):
    """Cameras and target with their rough poses, from the options of `poses`."""
    import numpy as np

    from workbench.cli.options import two_lengths
    from workbench.data.camera.camera import read_cameras
    from workbench.data.camera.rig import Rig
    from workbench.data.camera.target import read_target
    from workbench.plate.poses.target_in_view import View

    if target is None or not places:
        raise OptionError("--camera needs --target FILE, and --camera-at: roughly where the camera is")
    return View(
        rig=Rig(read_cameras(camera), (read_target(target),)),
        cameras=tuple(_place(text, "--camera-at") for text in places),
        target=_place(target_at, "--target-at"),
        depth=(0.0, np.inf) if depth is None else two_lengths(depth, "--depth"),
    )


def _place(text: str, option: str):
    """A pose from x,y,z in m and roll,pitch,yaw in degrees."""
    import numpy as np

    from workbench.base import se3

    numbers = opt.numbers(text)
    if numbers.shape != (6,):
        raise OptionError(f"{option} must be x,y,z,roll,pitch,yaw in m and degrees, got '{text}'")
    return se3.pose(se3.rpy_to_matrix(np.deg2rad(numbers[3:])), numbers[:3])

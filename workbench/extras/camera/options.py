"""Options of cameras: measurements from pixels."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, final

from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.cli.option_records import AbstractSource
from workbench.cli.options import option
from workbench.data.dataset import Dataset


@final
@dataclass(frozen=True)
class PixelSource(AbstractSource):
    """Corners in a table, or pictures in a folder."""

    target: Annotated[Path | None, option("Data are pixels: the board or tags seen, a target.toml.")] = None
    camera: Annotated[
        Path | None, option("With --target: the cameras (camera.toml); by default they are identified.")
    ] = None

    def read(self, path: Path, arm: Robot, joints: Path | None) -> Dataset | None:
        from workbench.extras.camera.folder import read_folder, unpacked
        from workbench.extras.camera.pixel_table import read_pixels
        from workbench.extras.camera.rig import read_rig

        if self.target is None:
            if self.camera is not None:
                raise OptionError("--camera needs --target FILE: the board or tags in view")
            return None
        rig, is_packed = read_rig(self.camera, self.target), path.is_file() and path.suffix.lower() == ".zip"
        if not (is_packed or path.is_dir()):
            return read_pixels(path, rig, joints=joints, dof=arm.dof)
        with unpacked(path.name, path.read_bytes()) if is_packed else nullcontext(path) as folder:
            return replace(read_folder(folder, rig=rig, joints=joints, dof=arm.dof), source=str(path))

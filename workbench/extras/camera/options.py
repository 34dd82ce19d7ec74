"""Options of cameras: measurements from pixels, and what a camera sees of poses."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, final

from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.joined_options import AbstractAim, AbstractSource
from workbench.cli.options import option
from workbench.data.dataset import Dataset
from workbench.plate.poses.sight import AbstractSight


@final
@dataclass(frozen=True)
class PixelSource(AbstractSource):
    """Corners in a table, or pictures in a folder."""

    target: Annotated[Path | None, option("The data are pixels: the board or tags seen, a target.toml.")] = (
        None
    )
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
        rig = read_rig(self.camera, self.target)
        if path.is_file() and path.suffix.lower() in (".zip", ".tar", ".gz", ".tgz"):
            with unpacked(path.name, path.read_bytes()) as folder:
                data = read_folder(folder, rig=rig, joints=joints, dof=arm.dof)
        elif path.is_dir():
            data = read_folder(path, rig=rig, joints=joints, dof=arm.dof)
        else:
            return read_pixels(path, rig, joints=joints, dof=arm.dof)
        return replace(data, source=str(path))


@final
@dataclass(frozen=True)
class CameraAim(AbstractAim):
    """Cameras and a target with their rough poses."""

    camera: Annotated[Path | None, option("A camera.toml: the target must be in view.")] = None
    target: Annotated[Path | None, option("With --camera: the target.toml in view.")] = None
    camera_at: Annotated[
        list[str] | None,
        option('Rough pose of each camera, in the world or on the tool: "x,y,z,roll,pitch,yaw" in m and °.'),
    ] = None
    target_at: Annotated[str, option("The same for the target.")] = "0,0,0,0,0,0"
    depth: Annotated[str | None, option("Distances at which pictures are sharp: 300mm,900mm.")] = None

    def sight(self) -> AbstractSight | None:
        if self.camera is None:
            return None
        import numpy as np

        from workbench.extras.camera.camera import read_cameras
        from workbench.extras.camera.rig import Rig
        from workbench.extras.camera.target import read_targets
        from workbench.extras.camera.target_in_view import TargetInView

        if self.target is None or not self.camera_at:
            raise OptionError("--camera needs --target FILE, and --camera-at, the camera's rough pose")
        return TargetInView(
            rig=Rig(read_cameras(self.camera), read_targets(self.target)),
            cameras=tuple(_place(text, "--camera-at") for text in self.camera_at),
            target=_place(self.target_at, "--target-at"),
            depth=(0.0, np.inf) if self.depth is None else opt.two_lengths(self.depth, "--depth"),
        )


def _place(text: str, option: str):
    """A pose from x,y,z in m and roll,pitch,yaw in degrees."""
    import numpy as np

    from workbench.base import se3

    numbers = opt.numbers(text)
    if numbers.shape != (6,):
        raise OptionError(f"{option} must be x,y,z,roll,pitch,yaw in m and degrees, got '{text}'")
    return se3.pose(se3.rpy_to_matrix(np.deg2rad(numbers[3:])), numbers[:3])

"""Pictures taken one by one: what each shows, and which are kept with their joints."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.base.files import write_text
from workbench.base.wording import plural
from workbench.extras.camera.camera import write_cameras
from workbench.extras.camera.likely_board import MIN_FOUND
from workbench.extras.camera.rig import Rig
from workbench.extras.camera.target import write_target
from workbench.session.part import AbstractPart

SHARP = 2.0
"""Blur of a picture [px, standard deviation] from which on it is not kept."""


@dataclass(frozen=True)
class Shot:
    """One picture.

    Args:
        name: Of its file.
        camera: That took it.
        picture: As a small JPEG.
        ids: Of tags, or of a board's corners.
        corners: Numbers of the tags' corners.
        uv: Where they are [px].
        reason: Why nothing was found; "" if something was.
        blur: How wide edges are [px].
        still: Whether camera, target and arm stood still.
        q: Joint positions [rad or m]; None where nobody said.
    """

    name: str
    camera: str
    picture: bytes
    ids: tuple[int, ...] = ()
    corners: tuple[int, ...] = ()
    uv: tuple[tuple[float, float], ...] = ()
    reason: str = ""
    blur: float = 0.0
    still: bool = True
    q: tuple[float, ...] | None = None

    @property
    def refused(self) -> str:
        """Why it is not kept; "" where it is."""
        if self.reason or len(self.ids) < MIN_FOUND:
            return self.reason or f"it shows {plural(len(self.ids), 'corner')}; {MIN_FOUND} are needed"
        if self.blur > SHARP:
            return (
                f"it is blurred by {self.blur:.1f} px, more than {SHARP:g}: hold still, focus, or add light"
            )
        if self.q is None:
            return "its joints are unknown: connect the arm (--source), or add a row to the folder's CSV"
        return "" if self.still else "the target still moves, or has not moved since the last picture"


@dataclass(frozen=True, eq=False)
class Previews(AbstractPart):
    """Small JPEG of every measured picture, by camera and image."""

    by_image: Mapping[tuple[str, str], bytes]
    is_of_measurements = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Capture(AbstractPart):
    """Pictures being taken.

    Args:
        source: Folder that is watched, or `device:N`.
        rig: Cameras and target.
        last: The newest picture, kept or not.
        kept: Those that are.
    """

    source: str
    rig: Rig
    last: Shot | None = None
    kept: tuple[Shot, ...] = ()

    def with_shot(self, shot: Shot) -> "Capture":
        """With a new picture; it takes the place of one of its name."""
        others = tuple(s for s in self.kept if (s.camera, s.name) != (shot.camera, shot.name))
        return replace(self, last=shot, kept=others if shot.refused else (*others, shot))

    def points(self, camera: str) -> Float[np.ndarray, "corners 2"]:
        """Corners of all kept pictures of a camera [px]."""
        return np.array([uv for s in self.kept if s.camera == camera for uv in s.uv]).reshape(-1, 2)

    def write(self, folder: Path) -> None:
        """The kept pictures as a folder of corners and joints that `read_folder` takes."""
        corners = ["image,camera,id,corner,u[px],v[px]"]
        joints: dict[str, str] = {}
        for shot in self.kept:
            assert shot.q is not None, "a kept picture has joints"
            joints[shot.name] = ",".join([shot.name, *map(repr, shot.q)])
            rows = zip(shot.ids, shot.corners, shot.uv, strict=True)
            corners += [f"{shot.name},{shot.camera},{i},{c},{u!r},{v!r}" for i, c, (u, v) in rows]
        head = ",".join(["image", *(f"q{k + 1}[rad]" for k in range(len(self.kept[0].q or ())))])
        write_text(folder / "corners.csv", "\n".join(corners) + "\n")
        write_text(folder / "joints.csv", "\n".join([head, *joints.values()]) + "\n")
        write_cameras(self.rig.cameras, folder / "camera.toml")
        write_target(self.rig.targets, folder / "target.toml")

"""C3D files: markers over time; extra `mocap`."""

from pathlib import Path
from typing import final

from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields
from workbench.data.readers.layouts.layout import AbstractFileLayout
from workbench.extras.logs.binary_recordings import read_c3d
from workbench.extras.logs.recording import Logged, choice


@final
class C3d(AbstractFileLayout):
    """Markers of a C3D file, or the one that `--columns "pose=NAME"` names."""

    name = "c3d"
    endings = (".c3d",)

    def matches(self, path: Path, head: bytes) -> bool:
        return path.suffix.lower() in self.endings

    def read(self, path: Path, naming: Naming | None) -> Fields:
        time, names, places = read_c3d(path)
        markers = dict(zip(names, places, strict=True))
        one = choice(naming, "pose")
        if one in markers:
            markers = {one: markers[one]}
        return Logged(time=time, markers=markers).fields(path, self.name, naming)

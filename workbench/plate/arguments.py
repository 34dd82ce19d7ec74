"""What stands for a plate or a region in calls: files, names, or a plate for its region."""

from pathlib import Path
from typing import Annotated, Any

from workbench.base.arguments import Like, Reads
from workbench.plate.measured_plate import load_plate
from workbench.plate.plate import Plate
from workbench.plate.region import Region


def as_plate(value: Any, given: Any = None) -> Any:
    """A plate of its file, or of the name of a built-in one; anything else as it is."""
    return load_plate(value) if isinstance(value, str | Path) else value


def _region(value: Any, given: Any) -> Any:
    plate = as_plate(value)
    return plate.region if isinstance(plate, Plate) else value


PlateLike = Like[Annotated[Plate, Reads("a Plate, its file, or a built-in plate by name", as_plate)]]
RegionOf = Annotated[Region, Reads("a Region, or a plate for its region", _region)]

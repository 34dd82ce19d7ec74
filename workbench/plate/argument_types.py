"""Arguments that represent a plate or a region: objects, files, names, or a plate for its region."""

from pathlib import Path
from typing import Any

import workbench.data.argument_types  # noqa: F401 what stands for arms and measurements
from workbench.base.argument_checks import Given, accept, checked_arguments
from workbench.plate.measured_plate import load_plate
from workbench.plate.plate import Plate
from workbench.plate.region import Region


def _plate(value: Any, given: Given) -> Any:
    return load_plate(value) if isinstance(value, str | Path) else value


def _region(value: Any, given: Given) -> Any:
    plate = _plate(value, given)
    return plate.region if isinstance(plate, Plate) else value


accept(Plate, "a Plate, its file, or a built-in plate by name", _plate)
accept(Region, "a Region, or a plate for its region", _region)

__all__ = ["checked_arguments"]

"""Recordings of an instrument: bodies and markers over time; one body, or all markers, are the tool."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.base.errors import DataError, OptionError
from workbench.base.remedy import remedy
from workbench.base.wording import listed
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields

Points = Float[np.ndarray, "frames 3"]
Turns = Float[np.ndarray, "frames 3 3"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Logged:
    """What an instrument saw, frame by frame; NaN where it lost sight.

    Args:
        time: Of every frame [s].
        bodies: Position [m] and orientation of each body by name; None where orientations are not stated.
        markers: Position of each marker by name [m].
        notes: Decisions, one sentence each.
    """

    time: Float[np.ndarray, " frames"]
    bodies: Mapping[str, tuple[Points, Turns | None]] = field(default_factory=dict)
    markers: Mapping[str, Points] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def fields(self, path: Path, layout: str, naming: Naming | None) -> Fields:
        """Columns of the tool: the body that was chosen or the only one, else every marker."""
        rotation, tool = None, dict(self.markers)
        note = f"markers m1 … m{len(tool)} are {listed(list(tool))}"
        if self.bodies:
            name = chosen(list(self.bodies), naming, f"{path}: bodies", "pose")
            position, rotation = self.bodies[name]
            tool, note = {name: position}, f"the tool is the body '{name}'"
        elif len(tool) == 1:
            note = f"the tool is the marker '{next(iter(tool))}'"
        elif not tool:
            raise DataError(f"{path}: there are neither bodies nor markers in this recording")
        values, headings = {"time": self.time}, dict[str, str]()
        for number, (name, position) in enumerate(tool.items(), 1):
            keys = [axis if len(tool) == 1 else f"m{number}{axis}" for axis in "xyz"]
            values |= dict(zip(keys, position.T, strict=True))
            headings |= dict.fromkeys(keys, name)
        return Fields(
            source=str(path),
            lines=tuple(range(1, len(self.time) + 1)),
            values=values,
            headings=headings,
            units=dict.fromkeys(headings, "m") | {"time": "s"},
            rotation=rotation,
            notes=(f"layout '{layout}'", *self.notes, note),
        )


def chosen(names: list[str], naming: Naming | None, what: str, key: str) -> str:
    """The only name, or that which `--columns "key=NAME"` chooses."""
    pairs = naming.pairs if naming is not None else ()
    wanted = next((pair.right[0].name for pair in pairs if pair.left.name == key), None)
    if wanted in names:
        return wanted
    if wanted is None and len(names) == 1:
        return names[0]
    why = f"'{wanted}' is none of them" if wanted is not None else "more than one"
    elsewhere = "choose with 'workbench identify --columns', or load a CSV here"
    how = remedy(f'choose with columns="{key}=NAME" (--columns)', page=elsewhere)
    raise OptionError(f"{what} {listed(names)}: {why}; {how}")

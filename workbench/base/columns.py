"""Columns of measurement files that hold one number, or one label, a row; or one number a joint.

One entry is all that a new column needs: reading, writing, previews, mappings, trajectories, laws of effects,
their plots and messages derive from it. That of another package stands in its record of parts, or in the
`brings` of its observation. Coordinates in groups (x y z, markers, sigma …) are known to
`data/readers/headings.py`.
"""

import re
from dataclasses import dataclass
from enum import Enum
from typing import final

from workbench.base.errors import OptionError
from workbench.base.units import Quantity
from workbench.parts import PartTable

_COORDINATE = re.compile(
    r"q(\d+|[wxyz])|[xyz]|r[xyz]|r[123]{2}|roll|pitch|yaw|m\d+[xyz]|sigma_r?[xyz]|tilt_[xy]\d+|"
    r"(force|moment)_[xyz]"
)
"""Names of coordinates that stand in groups: readers know them (`data/readers/headings.py`)."""


class Per(Enum):
    """What has one value of a column in every row."""

    ROW = "row"
    JOINT = "joint"


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Column:
    """One column.

    Args:
        name: In formats.md, without its unit.
        quantity: What it measures; None for labels.
        also: Other names of it in files.
        per: What has a value: joints have columns `name1`, `name2` …
        driver: Whether laws of effects may depend on it.
        observed: Whether a row that has it was observed.
        kept: Whether measurements keep it; else a reader uses it up.
        text: What it is, for messages; empty if the name says it.
        usual: Mean on virtual arms, and maximum deviation from it [our own unit].
    """

    name: str
    quantity: Quantity | None = None
    also: tuple[str, ...] = ()
    per: Per = Per.ROW
    driver: bool = False
    observed: bool = False
    kept: bool = True
    text: str = ""
    usual: tuple[float, float] | None = None

    def __post_init__(self):
        if taken := next((name for name in (self.name, *self.also) if _COORDINATE.fullmatch(name)), None):
            text = f"a column can't be called '{taken}': so are coordinates of poses and joints"
            raise OptionError(text, option="name", found=taken)

    @property
    def is_label(self) -> bool:
        """Whether it holds text."""
        return self.quantity is None

    def names(self, joints: int) -> list[str]:
        return [self.name] if self.per is Per.ROW else [f"{self.name}{j}" for j in range(1, joints + 1)]

    def headings(self, joints: int) -> list[str]:
        """The same with units, as in files that we write."""
        unit = "" if self.quantity in (None, Quantity.NUMBER) else f"[{self.quantity}]"
        return [f"{name}{unit}" for name in self.names(joints)]

    @property
    def requested(self) -> str:
        """How a message asks for it: `temperature[degC]`, or `torque1[N*m], torque2[N*m] …`."""
        text = f" ({self.text})" if self.text else ""
        return ", ".join(self.headings(2)) + (" …" if self.per is Per.JOINT else "") + text


COLUMNS: PartTable[Column] = PartTable(
    "columns",
    Column,
    Column(name="time", quantity=Quantity.TIME, also=("zeit", "timestamp", "t"), driver=True),
    Column(
        name="temperature",
        quantity=Quantity.TEMPERATURE,
        also=("temp", "temperatur", "measurement_temperature", "air_temperature"),
        driver=True,
        usual=(24.0, 5.0),
    ),
    Column(name="payload", quantity=Quantity.MASS, also=("nutzlast", "load", "mass"), driver=True),
    Column(
        name="torque",
        quantity=Quantity.TORQUE,
        also=("tau", "effort", "drehmoment", "moment"),
        per=Per.JOINT,
        driver=True,
    ),
    Column(
        name="direction",
        quantity=Quantity.NUMBER,
        also=("dir", "richtung"),
        per=Per.JOINT,
        driver=True,
        text="sign of each joint's last motion",
    ),
    Column(name="distance", quantity=Quantity.LENGTH, also=("dist", "abstand", "entfernung"), observed=True),
    Column(name="session", also=("sitzung", "placement", "aufstellung", "standort")),
    Column(name="group", also=("gruppe",)),
    Column(name="point", also=("socket", "seat", "punkt", "element_name", "feature_name", "point_name")),
    *(
        Column(name=n, also=(a,))
        for n, a in (("anchor", "anker"), ("draw_wire", "seil"), ("contact", "kontakt"))
    ),
    Column(name="exclude", also=("excluded", "ausschluss")),
    Column(name="reason", also=("grund",)),
    *(Column(name=name, kept=False) for name in ("image", "camera", "id", "corner")),
    *(Column(name=name, quantity=Quantity.PIXEL, kept=False) for name in "uv"),
)
"""All that is known, in the order in which they are written."""


def row_drivers() -> dict[str, Column]:
    """Those that may drive effects and have one number a row."""
    return {name: c for name, c in COLUMNS.items() if c.driver and c.per is Per.ROW}

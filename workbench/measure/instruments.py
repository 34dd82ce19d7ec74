"""Instruments: what they see of the tool, and how well.

Standard deviations are per axis and typical of the kind at a metre or two; give your own for a real one.
A new instrument is one more record; an outsider's registry is `{**INSTRUMENTS, "mine": Instrument(…)}`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from workbench.errors import OptionError
from workbench.types import frozen


class Observes(StrEnum):
    """What an instrument sees of the tool."""

    POSE = "pose"
    POINT = "point"
    MARKERS = "markers"
    DISTANCE = "distance"
    CONTACT = "contact"


FOUR_MARKERS = frozen(
    np.array([[0.06, 0.0, 0.0], [-0.04, 0.05, 0.0], [-0.03, -0.06, 0.0], [0.0, 0.0, 0.05]], float)
)
"""Places of the markers on the tool where nothing else is said [m]: no two distances are alike to 1 mm."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Instrument:
    """An instrument and its noise.

    Args:
        name: For people and the registry.
        observes: What it sees.
        sigma_position: Standard deviation of a coordinate or distance [m].
        sigma_rotation: Standard deviation of a rotation about an axis [rad]; None if it sees no rotation.
        note: What it is, in one sentence.
        markers: Places of the markers in the tool frame [m]; used by those that see markers.

    Raises:
        OptionError: a negative deviation, or a pose without one for its rotation.
    """

    name: str
    observes: Observes
    sigma_position: float
    sigma_rotation: float | None = None
    note: str = ""
    markers: Float[np.ndarray, "markers 3"] = field(default_factory=lambda: FOUR_MARKERS)

    def __post_init__(self):
        if self.sigma_position < 0 or (self.sigma_rotation or 0.0) < 0:
            raise OptionError(f"instrument '{self.name}' has a negative standard deviation; give 0 or more")
        if self.observes is Observes.POSE and self.sigma_rotation is None:
            raise OptionError(f"instrument '{self.name}' sees poses; give its sigma_rotation too")


def _kind(name: str, observes: Observes, millimetres: float, degrees: float | None, note: str) -> Instrument:
    return Instrument(
        name=name,
        observes=observes,
        sigma_position=millimetres * 1e-3,
        sigma_rotation=None if degrees is None else float(np.deg2rad(degrees)),
        note=note,
    )


INSTRUMENTS: Mapping[str, Instrument] = MappingProxyType(
    {
        instrument.name: instrument
        for instrument in (
            _kind("ideal", Observes.POSE, 0.0, 0.0, "full poses without noise"),
            _kind("plate", Observes.POSE, 0.1, 0.02, "the seat of a fixture plate's target"),
            _kind("socket", Observes.POINT, 0.05, None, "a ball in a conical socket of a plate"),
            _kind("laser-tracker", Observes.POINT, 0.02, None, "a laser tracker and one reflector"),
            _kind("tracker-6d", Observes.POSE, 0.05, 0.01, "a laser tracker with a 6-DoF probe"),
            _kind("photogrammetry", Observes.POINT, 0.06, None, "a photogrammetric camera and one mark"),
            _kind("motion-capture", Observes.MARKERS, 0.2, None, "a motion capture system, four markers"),
            _kind("touch-probe", Observes.CONTACT, 0.03, None, "a probe that touches fixed points"),
            _kind("ball-bar", Observes.DISTANCE, 0.005, None, "a telescoping ball-bar on fixed anchors"),
        )
    }
)
"""Every built-in instrument by name."""


def instrument_named(name: str, instruments: Mapping[str, Instrument] = INSTRUMENTS) -> Instrument:
    """The instrument of that name.

    Raises:
        OptionError: there is none.
    """
    if name not in instruments:
        raise OptionError(f"there is no instrument '{name}'; known are {', '.join(instruments)}")
    return instruments[name]

"""Instruments: what they see of the tool, and how well.

Standard deviations are per axis and typical of the kind at a metre or two; give your own for a real one.
Those that the Katana thesis compares are as it gives them (§§2.2, 3.3): a laser tracker's 20 µm, a
photogrammetric tracker's 60 µm, an optical tracker's 0.01 mm, an inclinometer's 0.001°.
A new instrument is one more record.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from math import radians

import numpy as np
from jaxtyping import Float

from workbench.arm.joint import NotNegative
from workbench.base import se3
from workbench.base.arguments import Count, admit
from workbench.base.errors import OptionError
from workbench.base.types import frozen


class Observes(StrEnum):
    """What an instrument sees of the tool."""

    POSE = "pose"
    POINT = "point"
    MARKERS = "markers"
    DISTANCE = "distance"
    CONTACT = "contact"
    RIGID_BODY = "rigid body"
    """Markers at known places of the tool, from which its pose is fitted row by row."""
    TILT = "tilt"
    """Where up is, seen from every moving link."""


FOUR_MARKERS = frozen(np.array([[0.06, 0, 0], [-0.04, 0.05, 0], [-0.03, -0.06, 0], [0, 0, 0.05]]))
"""Places of the markers on the tool where nothing else is said [m]: no two distances are alike to 1 mm."""
_CORNERS = np.deg2rad([90.0, 210.0, 330.0])
THREE_MARKERS = frozen(0.06 * np.column_stack([np.cos(_CORNERS), np.sin(_CORNERS), np.zeros(3)]))
"""Three markers about the tool point, which is their mean (Katana §3.3) [m]."""


@dataclass(frozen=True, eq=False)
class Instrument:
    """An instrument and its noise.

    Args:
        name: For people and the registry.
        observes: What it sees.
        sigma_position: Standard deviation of a coordinate or distance [m].
        sigma_rotation: Standard deviation of a rotation about an axis [rad]; None if it sees no rotation.
        markers: Places of the markers in the tool frame [m]; used by those that see markers.
        samples: How many readings are averaged into one.

    Raises:
        OptionError: a negative deviation, no samples, or a pose without a deviation of its rotation.
    """

    name: str
    observes: Observes
    sigma_position: NotNegative
    sigma_rotation: NotNegative | None = None
    markers: Float[np.ndarray, "markers 3"] = field(default_factory=lambda: FOUR_MARKERS)
    samples: Count = 1

    def __post_init__(self):
        admit(self)
        if self.observes is Observes.POSE and self.sigma_rotation is None:
            text = f"instrument '{self.name}' sees poses; give its sigma_rotation too"
            raise OptionError(text, option="sigma_rotation")

    @cached_property
    def deviations(self) -> tuple[float, float | None]:
        """Standard deviations of one averaged result: position [m], rotation [rad] if it sees any.

        Those of a pose from markers follow from their places u: the covariance of [p; φ] is
        σ² (Σ AᵀA)⁻¹ with A = [1, −[u]×]; the mean of the axes is given.
        """
        share = 1.0 / float(np.sqrt(self.samples))
        if self.observes is not Observes.RIGID_BODY:
            turn = None if self.sigma_rotation is None else share * self.sigma_rotation
            return share * self.sigma_position, turn
        a = np.concatenate([np.tile(np.eye(3), (len(self.markers), 1, 1)), -se3.skew(self.markers)], axis=2)
        spread = np.diag(np.linalg.inv(np.einsum("mij,mik->jk", a, a)))
        position, rotation = np.sqrt(spread.reshape(2, 3).mean(axis=1))
        return share * self.sigma_position * float(position), share * self.sigma_position * float(rotation)


INSTRUMENTS = {
    known.name: known
    for known in (
        Instrument("ideal", Observes.POSE, 0.0, 0.0),  # full poses without noise
        Instrument("plate", Observes.POSE, 1e-4, radians(0.02)),  # the seat of a fixture plate's target
        Instrument("socket", Observes.POINT, 5e-5),  # a ball in a conical socket of a plate
        Instrument("laser-tracker", Observes.POINT, 2e-5),  # a laser tracker and one reflector
        Instrument("tracker-6d", Observes.POSE, 5e-5, radians(0.01)),  # a laser tracker with a 6-DoF probe
        Instrument("photogrammetry", Observes.POINT, 6e-5),  # a photogrammetric camera and one mark
        Instrument("motion-capture", Observes.MARKERS, 2e-4),  # a motion capture system, four markers
        Instrument("touch-probe", Observes.CONTACT, 3e-5),  # a probe that touches fixed points
        Instrument("ball-bar", Observes.DISTANCE, 5e-6),  # a telescoping ball-bar on fixed anchors
        Instrument("photogrammetric-tracker", Observes.RIGID_BODY, 6e-5, None, THREE_MARKERS),  # and a camera
        Instrument("optotrak", Observes.RIGID_BODY, 1e-5, None, THREE_MARKERS),  # active, their mean the tool
        Instrument("wire", Observes.DISTANCE, 1e-4),  # a draw-wire sensor on fixed anchors
        Instrument("inclinometer", Observes.TILT, 0.0, radians(0.001)),  # one on every moving link
    )
}
"""Every instrument by name."""


def instrument_named(name: str) -> Instrument:
    if name not in INSTRUMENTS:
        text = f"unknown instrument '{name}'; known: {', '.join(INSTRUMENTS)}"
        raise OptionError(text, option="instrument", found=name)
    return INSTRUMENTS[name]

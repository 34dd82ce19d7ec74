"""Observations: one file per kind, all with the same interface."""

from workbench.data.observation import AbstractObservation, Channel, Linearised, OwnErrors, Unknown
from workbench.data.observations.contact import ContactObservation, PlaneObservation
from workbench.data.observations.distance import DistanceObservation
from workbench.data.observations.markers import MarkerObservation
from workbench.data.observations.point import PointObservation
from workbench.data.observations.pose import PoseObservation
from workbench.data.observations.tilt import TiltObservation
from workbench.parts import PartTable

OBSERVATIONS: PartTable[type[AbstractObservation]] = PartTable(
    "observations",
    AbstractObservation,
    PoseObservation,
    PointObservation,
    MarkerObservation,
    DistanceObservation,
    PlaneObservation,
    ContactObservation,
    TiltObservation,
    classes=True,
)
"""All kinds, in the order in which a row is asked; each row is seen by the first that fits it."""

__all__ = [
    "OBSERVATIONS",
    "AbstractObservation",
    "Channel",
    "ContactObservation",
    "DistanceObservation",
    "Linearised",
    "MarkerObservation",
    "OwnErrors",
    "PlaneObservation",
    "PointObservation",
    "PoseObservation",
    "TiltObservation",
    "Unknown",
]

"""Observations: all kinds, with the same interface."""

from workbench.data.observation import AbstractObservation
from workbench.data.observations.markers import MarkerObservation
from workbench.data.observations.places import ContactObservation, DistanceObservation, PlaneObservation
from workbench.data.observations.pose import PointObservation, PoseObservation
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

__all__ = ["OBSERVATIONS", "ContactObservation", "DistanceObservation", "PlaneObservation", "TiltObservation"]

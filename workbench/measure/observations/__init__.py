"""What an instrument can see: one file per observation, all with the same three answers."""

from workbench.measure.observations.contact import ContactObservation
from workbench.measure.observations.distance import DistanceObservation
from workbench.measure.observations.markers import MarkerObservation
from workbench.measure.observations.observation import AbstractObservation, Channel, Seen
from workbench.measure.observations.plane import PlaneObservation
from workbench.measure.observations.point import PointObservation
from workbench.measure.observations.pose import PoseObservation
from workbench.measure.observations.tilt import TiltObservation

OBSERVATIONS: tuple[type[AbstractObservation], ...] = (
    PoseObservation,
    PointObservation,
    MarkerObservation,
    DistanceObservation,
    PlaneObservation,
    ContactObservation,
    TiltObservation,
)
"""All kinds, in the order in which a row is asked; each row is seen by the first that fits it."""

__all__ = [
    "OBSERVATIONS",
    "AbstractObservation",
    "Channel",
    "ContactObservation",
    "DistanceObservation",
    "MarkerObservation",
    "PlaneObservation",
    "PointObservation",
    "PoseObservation",
    "Seen",
    "TiltObservation",
]

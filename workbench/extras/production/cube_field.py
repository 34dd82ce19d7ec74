"""A field of the region's cubes: the error that virtual arms have there after a calibration on the plate."""

from typing import final

from workbench.session.cube_fields import AbstractCubeField, CubeValues
from workbench.session.live_score import PlateTrial
from workbench.session.state import Session


@final
class VirtualArmErrorField(AbstractCubeField):
    """The root mean square over the arms of the last trial."""

    name, choice, title = "yield", "Error of virtual arms", "Error of virtual arms"
    meaning = "root mean square over those of the yield"

    def values(self, session: Session) -> CubeValues | None:
        trial = session.part(PlateTrial)
        if trial is None or trial.plate.region is not session.plate.region:
            return None
        return CubeValues.scaled(trial.errors)

    def inputs(self, session: Session) -> tuple[object, ...]:
        return (session.part(PlateTrial),)

    def missing(self, session: Session) -> str:
        if self.values(session) is None:
            return "no yield is known for this region; press Try this plate in the Plate tab"
        return ""

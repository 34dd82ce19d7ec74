"""Commands for the region: its corners and cubes, their colours, and the computations behind these."""

from dataclasses import replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.progress import Cancelled
from workbench.plate.cube_map import CubeMap, map_cubes
from workbench.plate.free_constants import identified_names
from workbench.plate.region import Region
from workbench.session.command import AbstractChange, AbstractChore, computed
from workbench.session.commands.drag import Place, check_place, plain
from workbench.session.cube_fields import CUBE_FIELDS, are_shown, cubes_of, field_of
from workbench.session.live_score import draw_region
from workbench.session.state import NO_FIELD, CubeView, Session
from workbench.session.target_steps import begin_step, rescore

MAX_CUBES = 12_000
"""More cubes than this are refused: the page would no longer be responsive."""
MAX_ORIENTATIONS = 8
"""Orientations of the targets that are tried in every cube, at most."""


class SetRegion(AbstractChange):
    """Give the region other corners or other cubes.

    Args:
        low: Place with the smallest coordinates [m].
        high: Place with the largest [m].
        cube: Maximum side of a cube [m].
        step: Whether undo goes back to before it; not so between the first and the last place of a drag.
    """

    title = "Change the region"

    low: Place
    high: Place
    cube: float
    step: bool = True

    key = computed(lambda self: ("region", self.step))

    def check(self, session: Session) -> None:
        check_place("the region", (*self.low, *self.high), (self.cube,))
        if (cubes := self.region().cubes) > MAX_CUBES:
            raise OptionError(f"the region would have {cubes} cubes, more than {MAX_CUBES}: make them larger")

    def apply(self, session: Session) -> Session:
        if self.step:
            session = begin_step(session)
        view = replace(session.region.view, layer=0)
        plate = replace(session.plate, region=self.region())
        return replace(session, plate=plate).updated("region", view=view)

    def region(self) -> Region:
        return Region(min=np.array(self.low), max=np.array(self.high), cube=self.cube)


class ShowCubes(AbstractChange):
    """Choose what colours the cubes, and which of them are seen."""

    key = "cubes"

    view: CubeView

    title = computed(lambda self: f"Colour the cubes by {self.view.field}")

    def check(self, session: Session) -> None:
        if self.view.field not in (NO_FIELD, *CUBE_FIELDS):
            text = f"unknown field of cubes '{self.view.field}'; choose {', '.join((NO_FIELD, *CUBE_FIELDS))}"
            raise OptionError(text, option="field", found=self.view.field)

    def apply(self, session: Session) -> Session:
        return session.updated("region", view=self.view)


class SampleRegion(AbstractChore[tuple[Region, np.ndarray]]):
    """Draw the poses of the region for which errors are predicted."""

    title = "Sampling poses in the region"

    low: Place
    high: Place
    robot: str

    @classmethod
    def needed(cls, session: Session) -> "SampleRegion | None":
        region = session.plate.region
        if session.region.sampled is region:
            return None
        return cls(plain(region.min), plain(region.max), session.robot.name)

    def compute(self, session: Session) -> tuple[Region, np.ndarray]:
        region = session.plate.region
        return region, draw_region(session.robot, replace(session.history.first.plate, region=region))

    def finish(self, session: Session, result: tuple[Region, np.ndarray]) -> Session:
        region, drawn = result
        if session.plate.region is not region:
            raise Cancelled
        return rescore(session.updated("region", sampled=region, q=drawn))


class MapCubes(AbstractChore[CubeMap]):
    """Evaluate every cube of the region, while the cubes are shown."""

    is_redone = True

    title = "Computing the cubes of the region"

    low: Place
    high: Place
    cube: float
    robot: str

    @classmethod
    def needed(cls, session: Session) -> "MapCubes | None":
        region, field = session.plate.region, field_of(session)
        if field is None or cubes_of(session) is not None or not are_shown(session):
            return None
        return cls(plain(region.min), plain(region.max), region.cube, session.robot.name)

    def compute(self, session: Session) -> CubeMap:
        turns = session.history.first.plate.poses[:MAX_ORIENTATIONS, :3, :3]  # whichever came since
        names = identified_names(session.robot)
        return map_cubes(session.robot, session.plate.region, turns, names=names)

    def finish(self, session: Session, result: CubeMap) -> Session:
        if session.plate.region is not result.region:
            raise Cancelled
        return session.updated("region", cubes=result)


CHORES = (SampleRegion, MapCubes)
"""Computations that a session requests by itself, the most urgent first."""

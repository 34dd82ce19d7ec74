"""A planned trajectory: the commanded joints, and the resulting nominal and calibrated tool poses."""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.session.played_motion import AbstractMotion, Played
from workbench.session.state import Session


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Track(AbstractMotion):
    """A trajectory with its tools, a row each moment; positions in the robot's base frame [m].

    Args:
        kind: `circle` or `line`.
        robot: The arm that is drawn along it.
        time: Of every row [s].
        q: Joint positions that are sent [rad or m].
        wanted: Where the tool is meant to be.
        reached: Where the erring tool is; the wanted places where none is known.
        notes: What was decided, one sentence each.
        is_corrected: Whether the joints are corrected with the calibrated arm.
        actual: The arm that errs, in the robot's base frame; None where nothing is known beside the nominal.
        before: Errors without a correction [m]; None where nothing is known.
        model_error: Mean error of the erring arm's model on held-out rows [m]; None where nobody knows it.
    """

    kind: str
    robot: Robot
    time: Float[np.ndarray, " rows"]
    q: Float[np.ndarray, "rows n"]
    wanted: Float[np.ndarray, "rows 3"]
    reached: Float[np.ndarray, "rows 3"]
    notes: tuple[str, ...]
    is_corrected: bool = False
    actual: Robot | None = None
    before: Float[np.ndarray, " rows"] | None = None
    model_error: float | None = None

    @property
    def duration(self) -> float:
        return float(self.time[-1])

    @property
    def errors(self) -> Float[np.ndarray, " rows"]:
        return np.linalg.norm(self.reached - self.wanted, axis=1)

    def at(self, time: float) -> Float[np.ndarray, " n"]:
        return np.array([np.interp(time, self.time, column) for column in self.q.T])

    def view(self) -> Float[np.ndarray, "rows 3"]:
        return self.wanted

    def looks_like(self, other: AbstractMotion) -> bool:
        return isinstance(other, Track) and (other.kind, other.robot) == (self.kind, self.robot)


def planned_track(session: Session) -> Track | None:
    """The trajectory that was planned last, if there is one."""
    played = session.part(Played)
    return played.motion if played is not None and isinstance(played.motion, Track) else None

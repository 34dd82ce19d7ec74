"""Unknown parts of base, tool and gravity per session, and the arm once they are found."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import FRAME_PARTS, Frame
from workbench.arm.gravity import LEVELLING_SIGMA, level_axes, levelled
from workbench.arm.mounting import Mounting
from workbench.arm.parameters import Parameter
from workbench.arm.robot import Robot


@dataclass(frozen=True, eq=False)
class FrameFreedom:
    """Which parts of base and tool are unknown, and whether each session has its own.

    Args:
        base: Parts of the base that are unknown, from `FRAME_PARTS`; empty if it is known.
        tool: Likewise of the tool.
        base_per_session: Whether every session has its own base.
        tool_per_session: Whether every session has its own tool.
        levelled: Whether the z axis of the measuring frame is known to point upwards.
    """

    base: tuple[str, ...] = ()
    tool: tuple[str, ...] = ()
    base_per_session: bool = False
    tool_per_session: bool = False
    levelled: bool = False

    @property
    def by_frame(self) -> tuple[tuple[str, tuple[str, ...], bool], ...]:
        """Base and tool: which parts are unknown, and whether every session has its own."""
        return ("base", self.base, self.base_per_session), ("tool", self.tool, self.tool_per_session)

    def start(self, robot: Robot, session: str) -> Mounting:
        """Mounting from which the search starts: the session's own, except for what all sessions share."""
        own, common = robot.sessions.get(session, robot.mounting), robot.mounting
        if own is common:
            return own
        return replace(
            own,
            base=common.base if self.base and not self.base_per_session else own.base,
            tool=common.tool if self.tool and not self.tool_per_session else own.tool,
            gravity=own.gravity if self.base_per_session else common.gravity,
        )

    def placed(self, robot: Robot, sessions: Sequence[str]) -> Robot:
        """The robot as mounted at the start of the search, by session."""
        if not robot.sessions:
            return robot
        return replace(robot, sessions={name: self.start(robot, name) for name in sessions})


def frame_name(frame: str, per_session: bool, session: str) -> str:
    """`base`, or `base[front]` where every session has its own."""
    return f"{frame}[{session}]" if per_session else frame


def gravity_names(session: str, freedom: FrameFreedom) -> tuple[str, str]:
    """Names of the two angles of gravity in a session; separate where every session has its own base."""
    x, y = (f"{frame_name('gravity', freedom.base_per_session, session)}.{axis}" for axis in "xy")
    return x, y


def frame_parameters(robot: Robot, sessions: Sequence[str], frames: FrameFreedom) -> list[Parameter]:
    """The unknown parts of base and tool, per session where they differ."""
    parameters = []
    for kind, parts, own in frames.by_frame:
        for session in sessions if own else sessions[:1]:
            frame: Frame = getattr(frames.start(robot, session), kind)
            for part in sorted(parts, key=FRAME_PARTS.index):
                place = FRAME_PARTS.index(part)
                nominal, unit = (float(frame.xyz[place]), "m") if place < 3 else (0.0, "rad")
                parameters.append(Parameter(f"{frame_name(kind, own, session)}.{part}", unit, nominal))
    return parameters


def moved_robot(
    nominal: Robot, freedom: FrameFreedom, measured: Sequence[str], values: Mapping[str, float]
) -> Robot:
    """A robot with unknowns set by name, its session frames and the measured sessions' included; gravity is
    along the z axis of the measuring frame where that is known to be level."""
    robot = nominal.with_values({n: v for n, v in values.items() if "[" not in n})
    level = freedom.levelled and not any(n.startswith("gravity") for n in values)
    if level:
        robot = robot.under(levelled(robot.gravity, robot.base.rotation))
    if not (freedom.base_per_session or freedom.tool_per_session or nominal.sessions):
        return robot
    sessions = {}
    for name in dict.fromkeys([*nominal.sessions, *measured]):
        own = freedom.start(robot, name).with_values(values, f"[{name}]")
        sessions[name] = replace(own, gravity=levelled(robot.gravity, own.base.rotation)) if level else own
    return replace(robot, sessions=sessions)


def level_constraint(
    robot: Robot, sessions: Sequence[str], frames: FrameFreedom, names: Sequence[str]
) -> Iterator[tuple[tuple[str, ...], Float[np.ndarray, "2 k"]]]:
    """Prior that gravity lies along the z axis of the measuring frame: a constraint between gravity and base.

    Args:
        names: The unknowns.

    Yields:
        Names of unknowns, and the combinations of them that are 0 with unit variance.
    """
    owners = {gravity_names(s, frames): s for s in reversed(sessions)}
    for angles, session in owners.items():
        base = frame_name("base", frames.base_per_session, session)
        arm = frames.placed(robot, sessions).in_session(session)
        parts = [f"{base}.{part}" for part in ("roll", "pitch", "yaw")]
        mine = [k for k, name in enumerate(parts) if name in names]
        wall = np.concatenate([np.eye(2), level_axes(arm.gravity)[:2, mine]], axis=1)
        yield (*angles, *(parts[k] for k in mine)), wall / LEVELLING_SIGMA

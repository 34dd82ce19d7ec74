"""The low-cost check of a path from end to end: drawn by an arm, scanned, read, reported (Katana §5.5.2)."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image as Pictures
from rich.console import Group, RenderableType
from rich.text import Text

from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError
from workbench.base.files import write_bytes
from workbench.base.types import Poses
from workbench.data.dataset import Dataset
from workbench.data.readers import Trajectory
from workbench.data.readers.read import read_fields
from workbench.data.writer import write_measurements
from workbench.extras.trajectories.curves import Circle, circle_through
from workbench.extras.trajectories.pencil.reading import (
    PlottedErrors,
    PlottedProfile,
    plotted_errors,
    plotted_profile,
    read_scan,
)
from workbench.extras.trajectories.pencil.sheet import Drawn, Image, draw, scan, sheet
from workbench.extras.trajectories.trajectory_files import path_state
from workbench.identification.errors.row_errors import Spread
from workbench.report.figures import COLOURS, INK, grid, look, new_figure, png
from workbench.report.json import Json, document
from workbench.report.numbers import short
from workbench.report.tables import new_table

PLOTTED = "workbench.plotted/1"
TURNED = float(np.deg2rad(3.0))
"""Maximum turn of a simulated sheet on the scanner [rad]."""
SHIFTED = 1e-3
"""Maximum shift of it [m]."""
NOT_ROUND = 1e-3
"""Distance of a trajectory from a circle from which on it is none, as a share of the radius."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Plotted:
    """A drawing that was read.

    Args:
        profile: The line beside the printed circle.
        errors: Of the tool's tip along the path; None without the path or the potentiometer.
        time: Of every row of these [s].
    """

    profile: PlottedProfile
    errors: PlottedErrors | None = None
    time: Float[np.ndarray, " rows"] | None = None


def write_sheet(radius: float, path: Path | str, *, dpi: float) -> Path:
    """Write the sheet to print as a picture that knows its size [radius in m]."""
    return _write(sheet(radius, dpi=dpi), path, dpi)


def draw_path(
    robot: Robot,
    trajectory: Trajectory,
    picture: Path | str,
    readings: Path | str,
    *,
    seed: int = 0,
    dpi: float = 300.0,
) -> Drawn:
    """Let an arm draw a circle on a sheet where the trajectory means it; write the scan and the readings.

    Args:
        robot: The arm that draws, with its effects.
        trajectory: Time, joints and poses of the circle, as `path circle` writes them.
        readings: Time and extension of the pencil, a table.
        seed: Of the paper's place on the scanner, grain and noise.
        dpi: Dots per inch.
    """
    circle, _ = path_circle(trajectory)
    q, time = trajectory.q, trajectory.time
    if q is None or time is None:
        raise DataError(f"{trajectory.source}: an arm that draws needs time[s] and joints (q1[rad] …)")
    robot.check_joints(q, trajectory.source)
    here = robot.with_frames(base=Frame())
    poses = tool_poses(here, path_state(q, trajectory))
    drawn = draw(poses, circle.centre, circle.along, circle.across)
    rng = np.random.default_rng(seed)
    image = scan(
        drawn,
        circle.radius,
        clockwise=float(np.median(poses[:, :3, 2] @ np.cross(circle.along, circle.across))) > 0.0,
        rng=rng,
        dpi=dpi,
        turned=float(rng.uniform(-TURNED, TURNED)),
        shifted=(float(rng.uniform(-SHIFTED, SHIFTED)), float(rng.uniform(-SHIFTED, SHIFTED))),
    )
    _write(image, picture, dpi)
    rows = Dataset(q=np.zeros((len(q), 0)), row=np.arange(len(q)), time=time, distance=drawn.extension)
    write_measurements(rows, readings)
    return drawn


def read_drawing(
    picture: Path | str,
    radius: float,
    *,
    trajectory: Trajectory | None = None,
    readings: Path | str | None = None,
) -> Plotted:
    """Read a scan; with the trajectory and the potentiometer's table also the errors of the tool's tip.

    Args:
        radius: Of the printed circle [m].
        trajectory: Time, poses of the circle that was commanded.
        readings: Table of `time[s]`, `distance[mm]`: how far the pencil stood out beyond its length.
    """
    profile = plotted_profile(read_scan(picture), radius, source=str(picture))
    if trajectory is None and readings is None:
        return Plotted(profile=profile)
    if trajectory is None or readings is None:
        raise OptionError("errors along the path need both the trajectory and the potentiometer's readings")
    circle, poses = path_circle(trajectory)
    if trajectory.time is None:
        raise DataError(f"{trajectory.source}: the path has no time; add the column time[s]")
    if abs(circle.radius - radius) > NOT_ROUND * radius:
        raise OptionError(
            f"{trajectory.source} is a circle of {1e3 * circle.radius:.4g} mm and the printed one has "
            f"{1e3 * radius:.4g} mm; give the radius that was printed"
        )
    errors = plotted_errors(
        profile,
        poses[:, :3, 3],
        poses[:, :3, 2],
        _extension(readings, trajectory.time),
        centre=circle.centre,
        along=circle.along,
        across=circle.across,
    )
    return Plotted(profile=profile, errors=errors, time=trajectory.time)


def path_circle(trajectory: Trajectory) -> tuple[Circle, Poses]:
    """The circle that a trajectory's poses follow, and the poses."""
    position, rotation = trajectory.position, trajectory.rotation
    if position is None or rotation is None:
        raise DataError(
            f"{trajectory.source}: a drawn path needs its poses (x[m] … qz), "
            "as `workbench path circle` writes them"
        )
    far = int(np.argmax(np.linalg.norm(position - position[0], axis=1)))
    try:
        circle = circle_through(np.concatenate([position[:1], position[far // 2 :]]))
    except OptionError as error:
        raise DataError(f"{trajectory.source}: the path is not a circle: {error}") from None
    off = np.abs(np.linalg.norm(position - circle.centre, axis=1) - circle.radius).max()
    if off > NOT_ROUND * circle.radius:
        raise DataError(
            f"{trajectory.source}: the path is {1e3 * off:.3g} mm off a circle; the check is made for circles"
        )
    poses = np.tile(np.eye(4), (len(position), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotation, position
    return circle, poses


def _extension(path: Path | str, time: np.ndarray) -> Float[np.ndarray, " rows"]:
    fields = read_fields(path, columns=None, sheet=None, layout="plain")
    if "time" not in fields.values or "distance" not in fields.values:
        raise DataError(f"{path}: readings of the potentiometer need the columns time[s] and distance[mm]")
    when, extension = fields.values["time"], fields.values["distance"]
    if when[0] > time[0] + 1e-6 or when[-1] < time[-1] - 1e-6:
        raise DataError(
            f"{path}: readings from {when[0]:g} to {when[-1]:g} s do not cover the path from {time[0]:g} to "
            f"{time[-1]:g} s; give those of the whole path"
        )
    return np.interp(time, when, extension)


def _write(image: Image, path: Path | str, dpi: float) -> Path:
    buffer = io.BytesIO()
    Pictures.fromarray(image).save(buffer, format="PNG", dpi=(dpi, dpi))
    return write_bytes(path, buffer.getvalue())


def plotted_json(found: Plotted) -> Json:
    """The reading as plain data; null where nothing was drawn."""
    profile, errors = found.profile, found.errors
    return document(
        PLOTTED,
        dot_mm=1e3 * profile.scale,
        oval=profile.oval,
        angle_deg=np.rad2deg(profile.angle),
        out_mm=1e3 * profile.out,
        time=found.time,
        errors_mm=None if errors is None else 1e3 * errors.vector,
    )


def plotted_table(found: Plotted) -> RenderableType:
    """Mean, rms and maximum of what was read."""
    profile, errors = found.profile, found.errors
    table = new_table("", "from the path", "mean [mm]", "rms [mm]", "max [mm]")
    rows = [("drawn line, outside", profile.out)]
    if errors is not None:
        rows += [("tool, outside", errors.out), ("tool, above", errors.above), ("tool", errors.distance)]
    for label, values in rows:
        spread = Spread.of(1e3 * np.abs(values[np.isfinite(values)]))
        table.add_row(label, *(short(v) for v in (spread.mean, spread.rms, spread.max)))
    missing = f"{100 * (1.0 - profile.drawn.mean()):.0f} % of the circle was not drawn"
    return Group(table, Text(f"one dot is {1e3 * profile.scale:.4f} mm; {missing}"))


def plotted_picture(found: Plotted) -> bytes:
    """The line around the circle, and errors over time, as a PNG file."""
    profile, errors, time = found.profile, found.errors, found.time
    with look():
        figure = new_figure(9.0 if errors is not None else 5.0, 3.2)
        panels = figure.subplots(1, 1 if errors is None else 2, squeeze=False)[0]
        panels[0].plot(np.rad2deg(profile.angle), 1e3 * profile.out, color=COLOURS[0])
        panels[0].axhline(0.0, color=INK, lw=0.6)
        panels[0].set_xticks(range(0, 361, 90))
        panels[0].set_xlabel("angle from the mark of the beginning, counter-clockwise [°]")
        panels[0].set_ylabel("drawn outside the circle [mm]")
        if errors is not None and time is not None:
            for label, values, colour in zip(
                ("outside", "above"), (errors.out, errors.above), COLOURS, strict=False
            ):
                panels[1].plot(time, 1e3 * values, color=colour, label=label)
            panels[1].axhline(0.0, color=INK, lw=0.6)
            panels[1].set_xlabel("time [s]")
            panels[1].set_ylabel("error of the tool [mm]")
            panels[1].legend()
        for axes in panels:
            grid(axes)
    return png(figure)

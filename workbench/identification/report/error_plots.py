"""Figures of single rows: before and after, against the noise, and over position and joints."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.arm import chain as chains
from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import joint_elements, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.identification.errors.row_errors import RowErrors
from workbench.identification.result import Evaluation, Identification
from workbench.report.colours import CALIBRATED, NOMINAL
from workbench.report.figures import COLOURS, INK, grid, look, new_figure, on_white, plain_ticks

KINDS = (
    ("position", 1e3, "mm"),
    ("rotation", float(np.rad2deg(1.0)), "°"),
    ("tilt", float(np.rad2deg(1.0)), "°"),
)
"""Errors of rows, the factor from SI to the unit in which they are drawn, and that unit."""
MAX_POINTS = 400
"""Maximum number of points in one plot of single rows; more are thinned evenly, which the caption states."""
MAX_GAP = 0.2
"""A gap without rows longer than this share of the range breaks the running median."""


def before_after(result: Identification, place: np.ndarray) -> Figure:
    """Error of every row with the nominal arm and with the best algorithm, on a logarithmic scale."""
    best = result.best
    before, after = _stack(result.nominal_rows), _stack((best.train_rows, best.held_out_rows))
    held = np.arange(len(place)) >= len(result.train_rows)
    kinds = measured(after)
    suspicious = np.zeros(len(place), bool)
    suspicious[best.fit.suspicious] = True
    chosen = _thinned(len(place), keep=suspicious)
    with look():
        figure = new_figure(10.0, 0.8 + 2.1 * len(kinds))
        panels = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, scale, unit) in zip(panels, kinds, strict=True):
            old, new = scale * getattr(before, name)[chosen], scale * getattr(after, name)[chosen]
            _dumbbells(axes, place[chosen], old, new, held[chosen], suspicious[chosen])
            axes.set_ylabel(f"{name} error [{unit}]")
            axes.set_xlim(0.0, len(place) + 1.0)
        panels[-1].set_xlabel("row, in order of measuring")
        panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, markerscale=1.4)
    return figure


def errors_of_rows(result: Evaluation) -> Figure:
    """Error of every row of an evaluation, in the order of the data."""
    shown = measured(result.rows)
    with look():
        figure = new_figure(10.0, 2.5 * len(shown))
        panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, scale, unit) in zip(panels, shown, strict=True):
            values = scale * getattr(result.rows, name)
            axes.plot(result.row_numbers, values, "o", ms=3, color=COLOURS[0], mew=0)
            axes.set_ylabel(f"{name} error [{unit}]")
            axes.set_ylim(0.0, None)
            grid(axes)
        panels[-1].set_xlabel("data row")
    return figure


def residual_histogram(result: Identification) -> Figure:
    """Residual components of the fitted rows in mm and degrees, with the noise that weighed them."""
    fit = result.best.fit
    components = fit.problem.physical(fit.whitened)
    turned, sigmas = fit.problem.component_channels, fit.problem.sigma
    tilts, degree = fit.problem.tilted_components, np.rad2deg(1.0)
    panels = []
    kinds = (
        (~turned, 1e3, "position residual", "mm"),
        (turned & ~tilts, degree, "rotation residual", "°"),
        (tilts, degree, "tilt residual", "°"),
    )
    for mine, scale, name, unit in kinds:
        if (measured := mine & np.isfinite(sigmas)).any():
            sigma = scale * float(np.median(sigmas[measured]))
            panels.append((components[mine] * scale, sigma, name, unit))
    with look():
        figure = new_figure(10.0, 2.9)
        for axes, (values, sigma, name, unit) in zip(
            figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True
        ):
            width = max(float(np.abs(values).max(initial=0.0)), 3.5 * sigma, 1e-12)
            bins = np.linspace(-width, width, 2 * int(np.clip(np.sqrt(len(values)), 8, 30)) + 1)
            axes.hist(values, bins=bins, density=True, color=CALIBRATED, alpha=0.55, label="residuals")
            x = np.linspace(-width, width, 241)
            curve = np.exp(-0.5 * (x / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))
            axes.plot(x, curve, color=INK, label=f"noise, σ = {sigma:.3g} {unit}")
            axes.set_xlabel(f"{name} [{unit}]")
            axes.set_ylabel(f"density [1/{unit}]")
            axes.legend(loc="upper right")
            grid(axes)
    return figure


def error_where(result: Identification) -> Figure | None:
    """Position error of the best algorithm against the distance from the first axis, and every joint.

    None if no positions were measured.
    """
    best, robot = result.best, result.best.fit.calibrated
    q = np.concatenate([result.data.q[result.train_rows], result.held_out_data.q])
    errors = 1e3 * _stack((best.train_rows, best.held_out_rows)).position
    seen = np.isfinite(errors)
    if not seen.any():
        return None
    held = np.arange(len(q)) >= len(result.train_rows)
    arm = robot.with_frames(base=Frame())
    where = [("distance from the first axis [m]", _radius(arm, q))]
    for k, joint in enumerate(robot.moving):
        angle = joint.kind is JointKind.REVOLUTE
        where.append((f"joint {k + 1} [{'°' if angle else 'm'}]", np.rad2deg(q[:, k]) if angle else q[:, k]))
    chosen = _thinned(len(q), keep=np.zeros(len(q), bool))
    with look():
        columns = 4
        lines = -(-len(where) // columns)
        figure = new_figure(10.0, 2.1 * lines + 0.2)
        panels = figure.subplots(lines, columns, sharey=True, squeeze=False).ravel()
        for axes, (label, x) in zip(panels, where, strict=False):
            for mine, ink in ((~held, CALIBRATED), (held, INK)):
                shown = chosen[mine[chosen]]
                axes.plot(x[shown], errors[shown], "o", ms=2.0, color=ink, alpha=0.55, mew=0)
            axes.plot(*_running_median(x[seen], errors[seen]), color=COLOURS[0], lw=1.6)
            axes.set_xlabel(label)
            axes.set_ylim(bottom=0.0)
            grid(axes, "both")
        for axes in panels[len(where) :]:
            axes.set_visible(False)
        for line in range(lines):
            panels[line * columns].set_ylabel("position error [mm]")
    return figure


def _stack(parts: tuple[RowErrors, RowErrors]) -> RowErrors:
    position, rotation, tilt = (np.concatenate([getattr(part, name) for part in parts]) for name, *_ in KINDS)
    return RowErrors(position, rotation, tilt)


def measured(rows: RowErrors) -> list[tuple[str, float, str]]:
    """Those of the kinds that any row has."""
    return [kind for kind in KINDS if np.isfinite(getattr(rows, kind[0])).any()]


def _thinned(rows: int, *, keep: np.ndarray) -> np.ndarray:
    """At most `MAX_POINTS` rows, evenly spread, and those that must be kept."""
    chosen = np.zeros(rows, bool)
    chosen[np.unique(np.linspace(0, rows - 1, min(rows, MAX_POINTS)).round().astype(int))] = True
    return np.flatnonzero(chosen | keep)


def _dumbbells(axes: Axes, x, old, new, held, suspicious) -> None:
    floor = max(float(np.nanmax(np.concatenate([old, new]), initial=0.0)), 1e-9) * 1e-9
    old, new = np.maximum(old, floor), np.maximum(new, floor)
    axes.set_yscale("log")
    axes.vlines(x, new, old, color=NOMINAL, lw=0.5, alpha=0.6)
    size = 3.0 if len(x) <= 150 else 2.0
    axes.plot(x, old, "o", ms=size, color=NOMINAL, mew=0, label="nominal")
    axes.plot(x[~held], new[~held], "o", ms=size, color=CALIBRATED, mew=0, label="identified, fitted rows")
    if held.any():
        axes.plot(x[held], new[held], "o", ms=size, color=INK, mew=0, label="identified, held-out rows")
    if suspicious.any():
        axes.plot(x[suspicious], new[suspicious], "o", ms=8, mfc="none", mec=COLOURS[3], label="stands out")
    plain_ticks(axes.yaxis)
    grid(axes)


def _radius(arm: Robot, q: np.ndarray) -> np.ndarray:
    """Distance of the tool from the first moving axis [m]."""
    element = int(joint_elements(arm)[0])
    before = chains.frames(arm.chain, q, np.array([element - 1]))[:, 0]
    axis = before[:, :3, int(arm.chain.axes[element]) % 3]
    arm_vector = tool_poses(arm, Motion(q))[:, :3, 3] - before[:, :3, 3]
    return np.linalg.norm(arm_vector - (arm_vector * axis).sum(1, keepdims=True) * axis, axis=1)


def _running_median(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Medians of up to 15 parts with equally many rows; gaps without rows break the line."""
    parts = np.array_split(np.argsort(x, kind="stable"), int(np.clip(len(x) // 8, 1, 15)))
    centre, middle = np.array([np.median(x[p]) for p in parts]), np.array([np.median(y[p]) for p in parts])
    gaps = np.flatnonzero(np.diff(centre) > MAX_GAP * max(float(np.ptp(x)), 1e-12)) + 1
    return np.insert(centre, gaps, np.nan), np.insert(middle, gaps, np.nan)


def evaluation_figure(result: Evaluation) -> Figure:
    return on_white(errors_of_rows(result))

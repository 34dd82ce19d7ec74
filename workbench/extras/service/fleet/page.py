"""A fleet as a page with its charts."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter, date2num
from matplotlib.figure import Figure

from workbench.arm.joint import JointKind
from workbench.base.errors import OptionError
from workbench.extras.service.fleet.movement import Law
from workbench.extras.service.fleet.report import ARM, fleet_json, notes_of
from workbench.extras.service.fleet.result import ArmReport, Fleet
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, INK, DrawnFigure, grid, look, new_figure, on_white, svg
from workbench.report.html import write_page

PAGE = "fleet.html"
DRAWN, PAGE_ROWS = 6, 200
"""Arms with a chart of their own, and in the page's table."""


def write_fleet(fleet: Fleet, folder: Path | str) -> Path:
    """Write `fleet.html`, its pictures as SVG files and `result.json`; returns the page's path."""
    drawings = [DrawnFigure("fleet", "Joints of all arms", FLEET, svg(fleet_chart(fleet), "fleet"))]
    for number, arm in enumerate((fleet.worn or fleet.worst_first)[:DRAWN], 1):
        name = f"drift-{number}"
        picture = svg(drift_chart(arm, factor=fleet.factor), name)
        drawings.append(DrawnFigure(name, arm.history.arm, DRIFT, picture))
    return write_page(
        folder,
        PAGE,
        drawings,
        fleet_json(fleet),
        package="workbench.extras.service.fleet",
        replaces=[f"drift-{number}.svg" for number in range(1, DRAWN + 1)],
        fleet=fleet,
        heads=ARM.headings,
        rows=[ARM.cells(arm) for arm in fleet.worn[:PAGE_ROWS]],
        more=max(len(fleet.worn) - PAGE_ROWS, 0),
        still=[f"{arm.history.arm} ({len(arm.history.dates)})" for arm in fleet.arms if not arm.moved],
        unread=[f"{arm.arm}: {arm.why}" for arm in fleet.unread],
        notes=notes_of(fleet),
    )


FLEET = (
    "Every dot is a joint of an arm: by how many σ its constants differ between the first and the last "
    "calibration, the largest of them. Beyond the dashed line something moved; these arms are named."
)
DRIFT = (
    "Change of one constant of each joint since the first calibration with ±2 σ: the one that moved most, "
    "else the joint's offset. Coloured lines: the law of what moved."
)
NAMED = 12
"""Arms that the picture names, the worst."""


def fleet_chart(fleet: Fleet) -> Figure:
    """By how many σ each joint of each arm moved."""
    joints = max((arm.history.robot.dof for arm in fleet.arms), default=1)
    named = {arm.history.arm for arm in fleet.worn[:NAMED]}
    rng = np.random.default_rng(0)
    with look():
        figure = new_figure(9.6, 3.4)
        axes = figure.subplots()
        places = np.arange(1, joints + 1) + rng.uniform(-0.27, 0.27, (len(fleet.arms), 1))
        sigmas = np.array([_sigmas(arm, joints, fleet.factor) for arm in fleet.arms]).reshape(places.shape)
        moved = np.array(
            [[j in {m.joint for m in arm.moved} for j in range(1, joints + 1)] for arm in fleet.arms]
        )
        for those, colour, size, alpha in ((~moved, COLOURS[0], 2.2, 0.35), (moved, COLOURS[1], 5.0, 0.95)):
            at = (places[those], np.maximum(sigmas[those], 0.05))
            axes.plot(*at, "o", ms=size, mew=0, color=colour, alpha=alpha, clip_on=False)
        for row, joint in np.argwhere(moved):
            if (name := fleet.arms[row].history.arm) in named:
                at = (places[row, joint], sigmas[row, joint])
                axes.annotate(name, at, (5, 3), textcoords="offset points", fontsize=7)
        axes.axhline(fleet.minimum, color=INK, lw=0.9, ls=(0, (3, 2)))
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_ylim(0.0, 1.4 * max(fleet.minimum, sigmas.max(initial=1.0)))
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.set_xticks(np.arange(1, joints + 1))
        axes.set_xlim(0.5, joints + 0.5)
        axes.set_xlabel("joint")
        axes.set_ylabel("moved by [σ]")
        grid(axes)
    return figure


def _sigmas(arm: ArmReport, joints: int, factor: float) -> np.ndarray:
    """Largest difference between first and last calibration among the constants of each joint [σ]."""
    history, found = arm.history, np.zeros(joints)
    spread = factor * np.hypot(history.std[0], history.std[-1])
    moved_by = np.abs(history.values[-1] - history.values[0]) / spread
    for name, sigmas in zip(history.names, moved_by, strict=True):
        head = name.partition(".")[0].removeprefix("joint")
        if head.isdigit():
            found[int(head) - 1] = max(found[int(head) - 1], sigmas)
    return found


def drift_chart(arm: ArmReport, *, factor: float) -> Figure:
    """The joints of one arm over time.

    Args:
        factor: By which standard errors are widened.
    """
    joints = arm.history.robot.dof
    columns = min(joints, 4)
    with look():
        figure = new_figure(9.6, 2.0 * -(-joints // columns))
        panels = figure.subplots(
            -(-joints // columns), columns, sharex=True, sharey=True, squeeze=False
        ).ravel()
        for joint, axes in enumerate(panels, 1):
            if joint > joints:
                axes.set_visible(False)
            else:
                _joint(axes, arm, joint, factor)
    return figure


def _joint(axes: Axes, arm: ArmReport, joint: int, factor: float) -> None:
    history = arm.history
    moved = next((m for m in arm.moved if m.joint == joint), None)
    offset = "d" if history.robot.moving[joint - 1].kind is JointKind.PRISMATIC else "theta"
    name = f"joint{joint}.{offset}" if moved is None else moved.name
    axes.set_title(f"joint {joint}", fontsize=8)
    grid(axes)
    axes.axhline(0.0, color=NOMINAL, lw=0.7)
    if name not in history.names:
        axes.text(0.5, 0.5, "offset not identified", transform=axes.transAxes, ha="center", fontsize=7)
        return
    k = history.names.index(name)
    x, y = np.asarray(date2num(list(history.dates))), 1e3 * (history.values[:, k] - history.values[0, k])
    colour = COLOURS[0] if moved is None else COLOURS[1]
    axes.errorbar(x, y, 2e3 * factor * history.std[:, k], fmt="o", ms=3.5, lw=0.9, capsize=2, color=colour)
    if moved is not None:
        shape = np.array([day >= moved.since for day in history.dates], float)
        if moved.law is Law.DRIFT:
            shape = history.days / history.days[-1]
        law = 1e3 * moved.shift * shape
        law += np.average(y - law, weights=history.std[:, k] ** -2)
        axes.plot(
            x, law, color=colour, lw=1.2, drawstyle="steps-post" if moved.law is Law.STEP else "default"
        )
    unit = "mrad" if name.endswith(("theta", "alpha", "beta")) else "10⁻³ SI"
    axes.set_ylabel(f"{name.partition('.')[2]} [{'mm' if name.endswith(('.a', '.d')) else unit}]")
    locator = AutoDateLocator(maxticks=4)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))


def fleet_figure(fleet: Fleet, arm: str | None = None) -> Figure:
    if arm is None:
        return on_white(fleet_chart(fleet))
    for known in fleet.arms:
        if known.history.arm == arm:
            return on_white(drift_chart(known, factor=fleet.factor))
    raise OptionError(
        f"there is no arm '{arm}' in the fleet; its name is that of its folder", option="arm", found=arm
    )

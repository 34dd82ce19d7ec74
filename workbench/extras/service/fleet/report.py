"""A fleet as tables, as plain data (`workbench.fleet/1`), and as a page with its pictures."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter, date2num
from matplotlib.figure import Figure
from rich.console import Group, RenderableType
from rich.text import Text

from workbench.arm.joint import JointKind
from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.extras.service.fleet.fleet import ArmReport, Fleet
from workbench.extras.service.fleet.movement import Law, Movement
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, INK, DrawnFigure, grid, look, new_figure, on_white, svg
from workbench.report.html import write_page
from workbench.report.json import Json, document
from workbench.report.result_fields import MM, ResultField, ResultFields
from workbench.report.tables import line

SCHEMA = "workbench.fleet/1"
PAGE = "fleet.html"
LISTED, DRAWN, PAGE_ROWS = 15, 6, 200
"""Arms in the terminal's table, with a chart of their own, and in the page's table."""


def shift_text(moved: Movement) -> str:
    """How far a constant moved."""
    unit = "mrad" if moved.name.endswith(("theta", "alpha", "beta")) else "10⁻³"
    unit = "mm" if moved.name.endswith((".a", ".d")) else unit
    return f"{1e3 * moved.shift:+.3g} {unit}".replace("-", "−")


def _of_worst(text: Callable[[Movement], str]) -> Callable[[ArmReport], str | None]:
    return lambda arm: None if arm.worst is None else text(arm.worst)


def _moved_most(arm: ArmReport) -> str:
    if arm.worst is not None:
        return arm.worst.name
    return "nothing" if len(arm.history.dates) > 1 else "one calibration"


MOVED = ResultFields(
    *("name", "joint", "law", "shift", "std", "sigmas", "since"),
    ResultField("rate_per_day", of="rate"),
    ResultField("tool", MM),
)
"""Of a `Movement`."""
ARM = ResultFields(
    ResultField("arm", of="history.arm", title="arm"),
    ResultField("dates", of="history.dates"),
    ResultField("worst_joint", of="joint"),
    ResultField("", title="moved most", of=_moved_most),
    ResultField("", title="by", of=_of_worst(shift_text)),
    ResultField("", title="σ", of=_of_worst(lambda worst: f"{worst.sigmas:.0f}")),
    ResultField("", title="since", of=_of_worst(lambda w: "drifts" if w.law is Law.DRIFT else f"{w.since}")),
    ResultField("tool", MM, title="tool", text="{:.2f}".format),
    ResultField("again_by", of="again", title="again by"),
    ResultField("moved", each=MOVED),
)
"""Of an `ArmReport`."""


def fleet_tables(fleet: Fleet) -> RenderableType:
    """The worst arms, those that could not be read, and what was decided."""
    shown = (fleet.worn or fleet.worst_first)[:LISTED]
    parts: list[RenderableType] = [ARM.table(plural(len(fleet.arms), "arm"), shown)]
    if (more := len(fleet.worn) - LISTED) > 0:
        parts.append(Text(f"and {more} more"))
    parts.append(Text(fleet.verdict, style="bold"))
    parts += [line("warning", f"{arm.arm}: {arm.why}") for arm in fleet.unread[:LISTED]]
    return Group(*parts, *(line("note", text) for text in notes_of(fleet)))


def notes_of(fleet: Fleet) -> tuple[str, ...]:
    """What was decided, one sentence each."""
    notes = [
        f"something moved beyond {fleet.minimum:.1f} σ, which chance exceeds in one of a hundred such fleets",
        f"again by: when a drift will have moved the tool by {1e3 * fleet.allowed:.3g} mm since the last "
        "calibration",
    ]
    if fleet.factor > 1.0:
        notes.append(
            f"calibrations scatter {fleet.factor:.2f} times as far as their errors imply; σ is widened"
        )
    return tuple(notes)


def fleet_json(fleet: Fleet) -> Json:
    """The result as plain data."""
    return document(
        SCHEMA,
        verdict=fleet.verdict,
        sigma_factor=fleet.factor,
        threshold_sigmas=fleet.minimum,
        allowed_mm=1e3 * fleet.allowed,
        arms=ARM.each(fleet.worst_first),
        unread=[{"arm": arm.arm, "reason": arm.why} for arm in fleet.unread],
        notes=notes_of(fleet),
    )


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
    raise OptionError(f"there is no arm '{arm}' in the fleet; its name is that of its folder")

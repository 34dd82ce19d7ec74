"""The load test as table, figure, CSV and JSON: the schema `workbench.loading/1`."""

import csv
import io
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Group, RenderableType
from rich.text import Text

from workbench.extras.katana.load_test.experiment import LoadTest
from workbench.extras.katana.load_test.joint_tilting_fit import KINDS, JointTilting
from workbench.extras.katana.load_test.postures import LoadTestPlan, PairPurpose, PosturePair
from workbench.extras.katana.load_test.tolerance import LENGTH
from workbench.identification.report.table import line, new_table
from workbench.report.figures import COLOURS, INK, grid, look, new_figure
from workbench.report.json import Json, document
from workbench.report.numbers import short

LOADING = "workbench.loading/1"
MDEG = 1e3 * float(np.rad2deg(1.0))
PARTS = (
    ("clearance", MDEG, "clearance [m°]"),
    ("backlash", MDEG, "backlash [m°]"),
    ("stiffness", 1e-3, "stiffness [kN·m/rad]"),
)
"""Sizes, factors to the units that people read, and headings."""
LABELS = {
    PairPurpose.CROSSWISE: "tilts in both directions",
    PairPurpose.REVERSAL: "turns in both directions",
    PairPurpose.SIZE: "light and heavy load",
}


LACKING = {
    PairPurpose.CROSSWISE: "tilts in both directions: its clearance does not show",
    PairPurpose.REVERSAL: "turns in both directions: its backlash does not show",
    PairPurpose.SIZE: "is loaded lightly and heavily: its stiffness does not show",
}


def load_test_table(found: LoadTest) -> RenderableType:
    """What was found of every joint, with standard errors, beside what the virtual arm hides."""
    headings = [heading.replace(" [", "\n[") for heading in ("joint", "", *(p[2] for p in PARTS))]
    table = new_table(f"{found.robot.name}: inclinometers in {len(found.plan.q)} postures", *headings)
    hidden = {j.joint: j for j in found.hidden}
    for joint in found.joints:
        table.add_row(str(joint.joint + 1), "found", *_cells(joint, errors=True))
        table.add_row("", "hidden", *_cells(hidden[joint.joint], errors=False), end_section=True)
    return Group(table, *(line("note", text) for text in notes(found)))


def notes(found: LoadTest) -> list[str]:
    """How the joints were loaded, one sentence each."""
    masses = sorted({pair.joint + 1 for pair in found.plan.pairs if pair.added.any()})
    out = []
    if masses:
        mass = max(pair.added.max() for pair in found.plan.pairs)
        out.append(f"{mass:g} kg were hung onto the tool for joint {_listed(masses)}")
    for joint in found.plan.unturned:
        text = f"gravity exerts no moment about joint {joint + 1}: inclinometers show how it tilts"
        pulled = any(s.joint == joint for s in found.side)
        out.append(text + (", poses under side pulls how it rotates" if pulled else " and nothing else"))
    for joint, purpose in found.plan.missing:
        out.append(f"no posture loads joint {joint + 1} so that it {LACKING[purpose]}")
    centre = max(j.com_tolerance for j in found.robot.joints)
    left_out = len(found.plan.q) - len(found.tilting.fit.problem.data)
    if left_out:
        out.append(
            f"{left_out} postures are left out, since small errors of the arm decide a load's side there"
        )
    out.append(
        f"standard errors include errors of lengths (up to {1e3 * LENGTH:g} mm), of link masses (as in the "
        "arm's file, or 10 %) and of their centres "
        f"(one σ of {1e3 * centre:g} mm along each axis, --centre-tolerance)"
    )
    return out


def load_test_json(found: LoadTest) -> Json:
    """The result as plain data in SI; joints count from 1."""
    hidden = {j.joint: j for j in found.hidden}
    return document(
        LOADING,
        robot=found.robot.name,
        joints=[
            {
                "joint": j.joint + 1,
                **{part: _size(j, part) for part in KINDS},
                "hidden": {part: getattr(hidden[j.joint], part) for part in KINDS},
            }
            for j in found.joints
        ],
        unturned=[j + 1 for j in found.plan.unturned],
        missing=[{"joint": j + 1, "purpose": str(p)} for j, p in found.plan.missing],
        postures=[_pair(pair) for pair in found.plan.pairs],
        pulls=[{"joint": s.joint + 1, "q": s.q, "wrench": s.wrench, "about": s.about} for s in found.side],
        notes=notes(found),
    )


def postures_csv(plan: LoadTestPlan) -> str:
    """The postures as a table: joint, purpose, joint positions, mass at the tool, moments."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    joints = [f"q{k + 1}[rad]" for k in range(plan.q.shape[1])]
    moments = ["about[N*m]", "across_x[N*m]", "across_y[N*m]"]
    writer.writerow(["loaded joint", "purpose", *joints, "payload[kg]", *moments])
    for pair in plan.pairs:
        for k in range(2):
            numbers = [*pair.q[k], pair.added[k], pair.about[k], *pair.across[k]]
            writer.writerow([pair.joint + 1, pair.purpose, *(float(v) for v in numbers)])
    return buffer.getvalue()


def load_test_figure(found: LoadTest) -> Figure:
    """Above, how the pairs of postures load each joint; below, what was found beside what is hidden."""
    joints = found.plan.joints
    with look():
        figure = new_figure(max(6.4, 1.7 * len(joints)), 5.0)
        halves: Any = figure.subfigures(2, 1)
        above, below = halves
        for axes, joint in zip(np.atleast_1d(above.subplots(1, len(joints))), joints, strict=True):
            _loads(axes, [pair for pair in found.plan.pairs if pair.joint == joint])
            axes.set_title(f"joint {joint + 1}")
        above.axes[0].set_ylabel("moment across [N·m]")
        above.supxlabel("moment about the axis [N·m]", fontsize=8)
        handles = [above.axes[0].plot([], [], color=COLOURS[k], marker="o", ms=3)[0] for k in range(3)]
        above.legend(handles, [LABELS[p] for p in PairPurpose], loc="outside upper right", ncols=3)
        for axes, (part, size, text) in zip(below.subplots(1, 3), PARTS, strict=True):
            _sizes(axes, found, part, size)
            axes.set_ylabel(text)
            axes.set_xlabel("joint")
    return figure


def _loads(axes, pairs: list[PosturePair]) -> None:
    """A line from one posture to the other; moments across with the sign of their larger component."""
    for pair in pairs:
        component = int(np.abs(pair.across).max(axis=0).argmax())
        size = np.linalg.norm(pair.across, axis=1) * np.sign(pair.across[:, component])
        colour = COLOURS[list(PairPurpose).index(pair.purpose)]
        axes.plot(pair.about, size, "o-", color=colour, ms=3, lw=0.8)
    axes.axhline(0.0, color=INK, lw=0.4)
    axes.axvline(0.0, color=INK, lw=0.4)


def _sizes(axes, found: LoadTest, part: str, size: float) -> None:
    joints = found.joints
    places = np.array([j.joint + 1 for j in joints])
    values, errors = (size * np.array([getattr(j, f"{part}{end}") for j in joints]) for end in ("", "_std"))
    hidden = size * np.array([getattr(j, part) for j in found.hidden])
    axes.errorbar(
        places, values, 2.0 * errors, fmt="o", ms=3.5, color=COLOURS[0], capsize=2, label="found, ±2σ"
    )
    axes.plot([j.joint + 1 for j in found.hidden], hidden, "o", ms=8, mfc="none", mec=INK, label="hidden")
    axes.set_xticks(places)
    axes.set_ylim(0.0, 1.25 * max(np.nanmax(values), hidden.max()))
    axes.legend(loc="lower left", fontsize=7)
    grid(axes)


def _cells(joint: JointTilting, *, errors: bool) -> list[Text]:
    """Sizes in the table's units, with standard errors or without; a dash for what was not fitted."""
    out = []
    for part, size, _ in PARTS:
        value, std = size * getattr(joint, part), size * getattr(joint, f"{part}_std")
        text = "–" if np.isnan(value) else short(value) + (f" ± {short(std)}" if errors else "")
        out.append(Text(text, style="bold" if errors else "dim"))
    return out


def _size(joint: JointTilting, part: str) -> Json:
    unit = "rad/(N*m)" if part == "compliance" else "rad"
    return {"value": getattr(joint, part), "std": getattr(joint, f"{part}_std"), "unit": unit}


def _pair(pair: PosturePair) -> Json:
    return {
        "joint": pair.joint + 1,
        "purpose": str(pair.purpose),
        "q": pair.q,
        "added_kg": pair.added,
        "about": pair.about,
        "across": pair.across,
    }


def _listed(numbers: list[int]) -> str:
    *others, last = map(str, numbers)
    return f"{', '.join(others)} and {last}" if others else last

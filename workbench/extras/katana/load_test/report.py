"""The load test as table and JSON: the schema `workbench.loading/1`."""

import numpy as np

from workbench.base.wording import joint_list
from workbench.extras.katana.load_test.experiment import LoadTest
from workbench.extras.katana.load_test.joint_tilting_fit import KINDS, JointTilting
from workbench.extras.katana.load_test.postures import PairPurpose
from workbench.extras.katana.load_test.tolerance import LENGTH
from workbench.report.blocks import Block, ResultTable, lines
from workbench.report.json import Json, document
from workbench.report.numbers import short
from workbench.report.result_fields import JOINT, ResultField, ResultFields

LOADING = "workbench.loading/1"
MDEG = 1e3 * float(np.rad2deg(1.0))
PARTS = (
    ("clearance", MDEG, "clearance\n[m°]"),
    ("backlash", MDEG, "backlash\n[m°]"),
    ("stiffness", 1e-3, "stiffness\n[kN·m/rad]"),
)
"""Sizes, factors to the units that people read, and headings."""
LACKING = {
    PairPurpose.CROSSWISE: "tilts in both directions: its clearance does not show",
    PairPurpose.REVERSAL: "turns in both directions: its backlash does not show",
    PairPurpose.SIZE: "is loaded lightly and heavily: its stiffness does not show",
}


def load_test_blocks(found: LoadTest) -> list[Block]:
    """What was found of every joint, with standard errors, beside what the virtual arm hides."""
    rows = []
    for joint, hidden in zip(found.joints, found.hidden, strict=True):
        rows.append((f"{joint.joint + 1}", "found", *_cells(joint, errors=True)))
        rows.append(("", "hidden", *_cells(hidden, errors=False)))
    title = f"{found.robot.name}: inclinometers in {len(found.plan.q)} postures"
    headings = ("joint", "", *(heading for _, _, heading in PARTS))
    return [ResultTable(title, headings, rows, words=2), *lines("note", notes(found))]


def notes(found: LoadTest) -> list[str]:
    """How the joints were loaded, one sentence each."""
    out = []
    if heavy := sorted({pair.joint for pair in found.plan.pairs if pair.added.any()}):
        mass = max(pair.added.max() for pair in found.plan.pairs)
        out.append(f"{mass:g} kg were hung onto the tool for {joint_list(heavy)}")
    for joint in found.plan.unturned:
        text = f"gravity exerts no moment about joint {joint + 1}: inclinometers show how it tilts"
        pulled = any(s.joint == joint for s in found.side)
        out.append(text + (", poses under side pulls how it rotates" if pulled else " and nothing else"))
    for joint, purpose in found.plan.missing:
        out.append(f"no posture loads joint {joint + 1} so that it {LACKING[purpose]}")
    if left_out := len(found.plan.q) - len(found.tilting.fit.problem.data):
        out.append(
            f"{left_out} postures are left out, since small errors of the arm decide a load's side there"
        )
    centre = max(j.com_tolerance for j in found.robot.joints)
    out.append(
        f"standard errors include errors of lengths (up to {1e3 * LENGTH:g} mm), of link masses (as in the "
        "arm's file, or 10 %) and of their centres "
        f"(one σ of {1e3 * centre:g} mm along each axis, --centre-tolerance)"
    )
    return out


def load_test_json(found: LoadTest) -> Json:
    """The result as plain data in SI; joints count from 1."""
    joints = [
        {"joint": joint.joint + 1}
        | {part: _size(joint, part) for part in KINDS}
        | {"hidden": {part: getattr(hidden, part) for part in KINDS}}
        for joint, hidden in zip(found.joints, found.hidden, strict=True)
    ]
    return document(
        LOADING,
        robot=found.robot.name,
        joints=joints,
        unturned=[j + 1 for j in found.plan.unturned],
        missing=[{"joint": j + 1, "purpose": str(p)} for j, p in found.plan.missing],
        postures=POSTURES.each(found.plan.pairs),
        pulls=PULLS.each(found.side),
        notes=notes(found),
    )


POSTURES = ResultFields(JOINT, "purpose", "q", ResultField("added_kg", of=lambda pair: pair.added))
PULLS = ResultFields(JOINT, "q", "wrench")


def _cells(joint: JointTilting, *, errors: bool) -> list[str]:
    """Sizes in the table's units, with standard errors or without; a dash for what was not fitted."""
    out = []
    for part, size, _ in PARTS:
        value, std = size * getattr(joint, part), size * getattr(joint, f"{part}_std")
        out.append("–" if np.isnan(value) else short(value) + (f" ± {short(std)}" if errors else ""))
    return out


def _size(joint: JointTilting, part: str) -> Json:
    unit = "rad/(N*m)" if part == "compliance" else "rad"
    return {"value": getattr(joint, part), "std": getattr(joint, f"{part}_std"), "unit": unit}

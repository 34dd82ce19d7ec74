"""The joint table as CSV: five constants a joint, to the last digit.

Arms that come from a table keep their convention, β included; others become standard DH, which any serial arm
has (`standard_dh`).
"""

import csv
import io
from collections.abc import Iterable
from typing import Any, final

import numpy as np

from workbench.arm.conventions import CONSTANTS, ORDERS
from workbench.arm.joint_frames import joint_frames, standard_dh
from workbench.arm.robot import Robot
from workbench.arm.robot_toml import robot_from_rows, robot_to_table
from workbench.exports.export_format import AbstractForm, Job

UNITS = {"theta": "rad", "d": "m", "a": "m", "alpha": "rad", "beta": "rad"}


def table_of(robot: Robot) -> tuple[str, list[dict[str, Any]]]:
    """Convention, and a row for every joint entry: its type and constants [rad, m]."""
    if robot.convention in ORDERS and not len(robot.chain.followers):
        rows = robot_to_table(robot)["joint"]
        return robot.convention, [
            {"type": r.get("type", "revolute"), **{c: r[c] for c in CONSTANTS}} for r in rows
        ]
    found = standard_dh(joint_frames(robot))
    kinds = [str(j.kind) for j in robot.moving]
    rows = [("fixed", found.before), *zip(kinds, found.rows, strict=True), ("fixed", found.behind)]
    return "dh", [
        {"type": kind, **dict(zip(CONSTANTS, (*row.tolist(), 0.0), strict=True))}
        for kind, row in rows
        if kind != "fixed" or np.any(row)
    ]


@final
class DhCsv(AbstractForm):
    """A table for spreadsheets, to the last digit; `workbench new` reads it."""

    name = "dh-csv"
    title = "joint table as CSV (rad, m)"
    ending = ".csv"

    def write(self, job: Job) -> str:
        convention, rows = table_of(job.robot)
        out = io.StringIO()
        out.write(f"# {job.robot.name}, convention = {convention}\n")
        table = csv.writer(out, lineterminator="\n")
        table.writerow(["joint", "type", *(f"{c}[{UNITS[c]}]" for c in CONSTANTS)])
        for number, row in enumerate(rows, 1):
            table.writerow([number, row["type"], *(repr(float(row[c])) for c in CONSTANTS)])
        return out.getvalue()

    def read(self, text: str, job: Job) -> Robot:
        head, _, body = text.partition("\n")
        convention = head.rpartition("convention = ")[2]
        rows = [
            {"type": r["type"], **{c: float(r[f"{c}[{UNITS[c]}]"]) for c in CONSTANTS}}
            for r in csv.DictReader(io.StringIO(body))
        ]
        arm = robot_from_rows(rows, convention, name=job.robot.name, limits=job.robot.limits)
        return arm.with_frames(tool=job.robot.tool)

    def notes(self, job: Job) -> Iterable[str]:
        if not np.array_equal(job.robot.tool.pose, np.eye(4)):
            yield "base and tool are not part of the table"

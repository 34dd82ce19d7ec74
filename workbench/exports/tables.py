"""Joint tables: Denavit–Hartenberg as CSV and LaTeX, and the calibration.conf of UR controllers.

    calibration.conf    delta_theta, delta_a, delta_d, delta_alpha: calibrated minus nominal standard DH

Arms that come from a table keep their convention, β included; others become standard DH, which any serial arm
has (`standard_dh`). A UR controller computes from its base to joint 6: what lies behind, as far as it is no
turn about joint 6, is said as a tool frame.

Sources: DH parameters for calculations of kinematics and dynamics, and calibration.conf, of Universal Robots.
"""

import csv
import io
import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, final

import numpy as np

from workbench.arm.conventions import CONSTANTS, ORDERS
from workbench.arm.joint_frames import StandardDh, dh_pose, joint_frames, standard_dh
from workbench.arm.robot import Frame, JointKind, Robot
from workbench.arm.robot_toml import robot_from_rows, robot_to_table
from workbench.base import se3
from workbench.base.errors import FileError, OptionError
from workbench.exports.export_format import AbstractForm, Job, tool_note

UNITS = {"theta": "rad", "d": "m", "a": "m", "alpha": "rad", "beta": "rad"}
SYMBOLS = (r"\theta", "d", "a", r"\alpha", r"\beta")
DELTAS = ("theta", "a", "d", "alpha")
DELTA = re.compile(r"^\s*delta_(theta|a|d|alpha)\s*=\s*\[([^\]]*)\]", re.MULTILINE)


def table_of(robot: Robot) -> tuple[str, list[dict[str, Any]]]:
    """Convention, and a row for every joint entry: its type and constants [rad, m]."""
    if robot.convention in ORDERS:
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


def _robot(rows: list[dict[str, Any]], convention: str, like: Robot) -> Robot:
    arm = robot_from_rows(rows, convention, name=like.name, limits=like.limits)
    return arm.with_frames(tool=like.tool)


class AbstractJointTable(AbstractForm):
    """A table of the joints, without base and tool."""

    def notes(self, job: Job) -> Iterable[str]:
        if not np.array_equal(job.robot.tool.pose, np.eye(4)):
            yield "base and tool are not part of the table"


@final
class DhCsv(AbstractJointTable):
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
        return _robot(rows, convention, job.robot)


@final
class DhLatex(AbstractJointTable):
    """A table for papers: degrees and millimetres, rounded as one reads them."""

    name = "dh-latex"
    title = "joint table as LaTeX (deg, mm)"
    ending = ".tex"

    def write(self, job: Job) -> str:
        convention, rows = table_of(job.robot)
        angles = [UNITS[c] == "rad" for c in CONSTANTS]
        units = [r"\degree" if a else r"\mathrm{mm}" for a in angles]
        heads = [rf"${s}$ [${u}$]" for s, u in zip(SYMBOLS, units, strict=True)]
        lines = [f"% {job.robot.name}, convention = {convention}", r"\begin{tabular}{lrrrrr}"]
        lines += [" & ".join(["joint", *heads]) + r" \\ \hline"]
        moving = 0
        for row in rows:
            moving += row["type"] != "fixed"
            cells = [
                f"{np.rad2deg(row[c]):.6f}" if angle else f"{1e3 * row[c]:.4f}"
                for c, angle in zip(CONSTANTS, angles, strict=True)
            ]
            label = {"fixed": "fixed", "prismatic": f"{moving} (slides)"}.get(row["type"], str(moving))
            lines.append(" & ".join([label, *cells]) + r" \\")
        return "\n".join([*lines, r"\end{tabular}", ""])

    def read(self, text: str, job: Job) -> Robot:
        first, *lines = text.splitlines()
        rows = []
        for line in lines[2:-1]:
            label, *cells = line.removesuffix(r" \\").split(" & ")
            kind = "fixed" if label == "fixed" else "prismatic" if "slides" in label else "revolute"
            sizes = (np.deg2rad(1.0) if UNITS[c] == "rad" else 1e-3 for c in CONSTANTS)
            values = dict(
                zip(CONSTANTS, (float(v) * s for v, s in zip(cells, sizes, strict=True)), strict=True)
            )
            rows.append({"type": kind, **values})
        return _robot(rows, first.rpartition("convention = ")[2], job.robot)


@final
class UrCalibration(AbstractForm):
    """The file that a UR controller adds to its nominal table."""

    name = "ur-calibration"
    title = "calibration.conf of a UR controller (delta_theta, delta_a, delta_d, delta_alpha)"
    ending = ".conf"

    def write(self, job: Job) -> str:
        table, _ = self._divided(job)
        deltas = table - self._nominal(job)
        columns = dict(zip(CONSTANTS, deltas.T, strict=False))
        lines = {n: f"delta_{n} = [ {', '.join(repr(float(v)) for v in columns[n])}]" for n in DELTAS}
        if job.source is None:
            return "\n".join(["[mounting]", *lines.values(), ""])
        if {m[1] for m in DELTA.finditer(job.source)} != set(DELTAS):
            raise FileError(
                "has no delta_theta, delta_a, delta_d and delta_alpha; give the arm's own calibration.conf",
                path="the source",
            )
        return DELTA.sub(lambda found: lines[found[1]], job.source)

    def read(self, text: str, job: Job) -> Robot:
        nominal = self._nominal(job)
        deltas = {m[1]: np.array([float(v) for v in m[2].split(",")]) for m in DELTA.finditer(text)}
        if set(deltas) != set(DELTAS) or any(len(v) != len(nominal) for v in deltas.values()):
            raise FileError(
                f"needs delta_theta, delta_a, delta_d and delta_alpha, {len(nominal)} numbers each",
                path="the calibration.conf",
            )
        rows = nominal + np.column_stack([deltas[c] for c in CONSTANTS[:4]])
        arm = robot_from_rows(rows.tolist(), "dh", name=job.robot.name, limits=job.robot.limits)
        return arm.with_frames(tool=self._tool(job))

    def notes(self, job: Job) -> Iterable[str]:
        yield from tool_note(self._tool(job).pose)
        yield "keep a copy of the controller's own file: it is the factory's calibration"
        if job.source is None:
            yield (
                "give the arm's own calibration.conf as --source, whose other lines (checksums, raw offsets) "
                "are then kept as they are"
            )

    def _nominal(self, job: Job) -> np.ndarray:
        nominal = job.require_nominal(self.name)
        rows = table_of(nominal)[1]
        turning = all(j.kind is JointKind.REVOLUTE for j in nominal.joints)
        if nominal.convention not in ("dh", "hayati") or any(r["beta"] for r in rows) or not turning:
            raise OptionError(
                f"--for {self.name} needs a nominal arm in standard DH, got '{nominal.name}' in "
                f"{nominal.convention}; give ur5e or the like"
            )
        return np.array([[r[c] for c in CONSTANTS[:4]] for r in rows])

    def _divided(self, job: Job) -> tuple[np.ndarray, np.ndarray]:
        """The table up to joint n, whose a and α stay nominal, and what lies behind it."""
        nominal = self._nominal(job)
        found: StandardDh = standard_dh(job.frames, nominal[:, 0].tolist())
        rows, here = found.rows.copy(), np.eye(4)
        for row in rows[:-1]:
            here = here @ dh_pose(row)
        left = se3.inverse(here) @ se3.inverse(dh_pose(found.before)) @ job.frames.at_zero[-1]
        turn = left[:3, :3] @ dh_pose(nominal[-1])[:3, :3].T
        rows[-1] = nominal[-1]
        rows[-1, 0] = np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])
        rows[-1, 1] = left[2, 3]
        return rows, se3.inverse(dh_pose(rows[-1])) @ left

    def _tool(self, job: Job) -> Frame:
        tool = job.robot.tool
        return replace(Frame.from_pose(self._divided(job)[1] @ tool.pose), free=tool.free)

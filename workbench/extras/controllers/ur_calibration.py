"""The calibration.conf that a UR controller adds to its nominal table.

    delta_theta, delta_a, delta_d, delta_alpha: calibrated minus nominal standard DH

The controller computes from its base to joint 6: what lies behind, as far as it is no turn about joint 6, is
reported as a tool frame.

Sources: DH parameters for calculations of kinematics and dynamics, and calibration.conf, of Universal Robots.
"""

import re
from collections.abc import Iterable
from typing import final

import numpy as np

from workbench.arm.conventions import CONSTANTS
from workbench.arm.frame import Frame
from workbench.arm.joint_frames import StandardDh, dh_pose, standard_dh
from workbench.arm.robot import JointKind, Robot
from workbench.arm.robot_toml import robot_from_rows
from workbench.base import se3
from workbench.base.errors import FileError, OptionError
from workbench.exports.dh_csv import table_of
from workbench.exports.export_format import AbstractForm, Job, tool_note

DELTAS = ("theta", "a", "d", "alpha")
DELTA = re.compile(r"^\s*delta_(theta|a|d|alpha)\s*=\s*\[([^\]]*)\]", re.MULTILINE)


@final
class UrCalibration(AbstractForm):
    """The file that a UR controller adds to its nominal table."""

    name = "ur-calibration"
    title = "calibration.conf of a UR controller (delta_theta, delta_a, delta_d, delta_alpha)"
    ending = ".conf"

    def write(self, job: Job) -> str:
        deltas = self._divided(job)[0] - self._nominal(job)
        columns = dict(zip(CONSTANTS, deltas.T, strict=False))
        lines = {n: f"delta_{n} = [ {', '.join(repr(float(v)) for v in columns[n])}]" for n in DELTAS}
        if job.source is None:
            return "\n".join(["[mounting]", *lines.values(), ""])
        if {m[1] for m in DELTA.finditer(job.source)} != set(DELTAS):
            text = "has no delta_theta, delta_a, delta_d and delta_alpha; give the arm's own calibration.conf"
            raise FileError(text, path="the source")
        return DELTA.sub(lambda found: lines[found[1]], job.source)

    def read(self, text: str, job: Job) -> Robot:
        nominal = self._nominal(job)
        deltas = {m[1]: np.array([float(v) for v in m[2].split(",")]) for m in DELTA.finditer(text)}
        if set(deltas) != set(DELTAS) or any(len(v) != len(nominal) for v in deltas.values()):
            wrong = f"needs delta_theta, delta_a, delta_d and delta_alpha, {len(nominal)} numbers each"
            raise FileError(wrong, path="the calibration.conf")
        rows = nominal + np.column_stack([deltas[c] for c in CONSTANTS[:4]])
        arm = robot_from_rows(rows.tolist(), "dh", name=job.robot.name, limits=job.robot.limits)
        return arm.with_frames(tool=self._tool(job))

    def notes(self, job: Job) -> Iterable[str]:
        yield from tool_note(self._tool(job).pose)
        yield "keep a copy of the controller's own file: it is the factory calibration"
        if job.source is None:
            yield "give the arm's own calibration.conf as --into: its other lines (checksums) then stay"

    def _nominal(self, job: Job) -> np.ndarray:
        nominal = job.required(job.nominal, self.name, "that the controller has")
        rows = table_of(nominal)[1]
        turning = all(j.kind is JointKind.REVOLUTE for j in nominal.joints)
        if nominal.convention not in ("dh", "hayati") or any(r["beta"] for r in rows) or not turning:
            found = f"'{nominal.name}' in {nominal.convention}; give for example ur5e"
            raise OptionError(f"--for {self.name} needs a nominal arm in standard DH, got {found}")
        return np.array([[r[c] for c in CONSTANTS[:4]] for r in rows])

    def _divided(self, job: Job) -> tuple[np.ndarray, np.ndarray]:
        """The table up to joint n, whose a and α stay nominal, and what lies behind it."""
        nominal = self._nominal(job)
        found: StandardDh = standard_dh(job.frames, nominal)
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
        return Frame.from_pose(self._divided(job)[1] @ tool.pose, tool.free)

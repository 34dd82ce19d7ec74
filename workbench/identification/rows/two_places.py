"""Rows that lie off the others by one and the same vector: a reflector in one of two seats, two stations, a
frame that was knocked. It keeps the measuring frame's axes or the tool's."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.advice import beside
from workbench.base.wording import in_mm, ranges
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.fit import Fit

BIMODAL = 0.2
"""Maximum share of the residuals' variance along their widest direction that two groups leave: of normal ones
they leave 0.36, of uniform ones 0.25."""
MIN_ROWS, MIN_SHARE = 30, 0.1
"""Minimum number of rows, and their minimum share in either group: fewer are outliers."""
ROUNDS = 8
"""Maximum number of refits, so that geometry takes no part of the vector."""


@beside("rows that lie off together", "")
def two_places(fit: Fit, data: Dataset) -> str:
    """`30 of 90 rows (every 3rd, from row 0) lie 3 mm off the others together …`, or empty.

    Args:
        fit: Fit to most of the rows.
        data: They and those that were excluded as outliers.
    """
    problem, points, motion = fit.problem, data.position, Motion.of(data)
    if points is None or len(data) < MIN_ROWS or len(data.sessions) > 1 or not np.isfinite(points).all():
        return ""
    turned = tool_poses(fit.arm.in_session(""), motion)[:, :3, :3]
    turn = {"the measuring frame": np.eye(3)[None], "the tool": turned}

    def off(axes: str, x: np.ndarray) -> Float[np.ndarray, "rows 3"]:
        seen = tool_poses(problem.frames.placed(problem.robot_at(x), data.sessions).in_session(""), motion)
        return ((points - seen[:, :3, 3])[:, None] @ turn[axes])[:, 0]

    groups = {axes: _halves(off(axes, fit.x)) for axes in turn}
    axes = min(groups, key=lambda a: groups[a][0])
    (share, away), left = groups[axes], off(axes, fit.x)
    for _ in range(ROUNDS if share < BIMODAL and not problem.robot.effects else 0):
        shift = left[away].mean(0) - left[~away].mean(0)
        moved = replace(data, position=points - away[:, None] * (turn[axes] @ shift))
        left = off(axes, Opt2(limit=20).search(problem.again(data=moved)).x)
        new = (left - 0.5 * (left[away].mean(0) + left[~away].mean(0))) @ shift > 0.0
        if (new == away).all() or not MIN_SHARE < new.mean() < 1.0 - MIN_SHARE:
            break
        away = new
    few = away if away.mean() <= 0.5 else ~away
    if share > BIMODAL or few.mean() < MIN_SHARE:
        return ""
    shift = left[few].mean(0) - left[~few].mean(0)
    known = [(n, v) for n in ("payload", "temperature") if (v := getattr(data, n)) is not None]
    told = [n for n, v in known if (v[few].min() - v[~few].max()) * (v[few].max() - v[~few].min()) > 0.0]
    more = f"the {told[0]} tells them apart" if told else "tell them apart by a column 'session'"
    return (
        f"{few.sum()} of {len(few)} rows ({_which(data.row, few)}) lie "
        f"{in_mm(float(np.linalg.norm(shift)))} off the others together, by "
        f"{', '.join(f'{1e3 * v:.2f}' for v in shift)} mm in x, y, z of {axes}: "
        f"another reflector, seat, station or tool, or a knock? {more}"
    )


def _which(row: Int[np.ndarray, " rows"], few: Bool[np.ndarray, " rows"]) -> str:
    """`every 3rd, from row 0`, or the rows."""
    rows = row[few]
    step = int(np.gcd.reduce(np.diff(rows)))
    if step > 1 and ((row % step == rows[0] % step) == few).all():
        ending = {1: "st", 2: "nd", 3: "rd"}.get(step % 10 if step % 100 not in (11, 12, 13) else 0, "th")
        return f"every {step}{ending}, from row {rows[0] % step}"
    return f"rows {ranges(rows)}"


def _halves(off: Float[np.ndarray, "rows 3"]) -> tuple[float, Bool[np.ndarray, " rows"]]:
    """Two groups along the widest direction, by the cut that leaves least within them, and what share."""
    along = (off - off.mean(0)) @ np.linalg.svd(off - off.mean(0), full_matrices=False)[2][0]
    order, count = np.argsort(along), np.arange(1, len(along))
    between = np.cumsum(along[order])[:-1] ** 2 * (1.0 / count + 1.0 / (len(along) - count))
    best = int(np.argmax(between))
    return 1.0 - float(between[best] / (along @ along)), np.argsort(order) > best

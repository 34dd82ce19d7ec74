"""Rows that lie off the others by one and the same vector: two reflectors, stations or tools in one table."""

from dataclasses import replace

import numpy as np

from workbench.arm import chain as chains
from workbench.base.advice import beside
from workbench.base.wording import in_mm, ranges
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.fit import Fit

BIMODAL = 0.2
"""Maximum share of the residuals' variance along their widest direction that two groups leave: of normal ones
they leave 0.36, of uniform ones 0.25."""
MIN_SHARE, MIN_ROWS = 0.1, 5
"""Minimum size of either group."""
CLEAR = 2.5
"""How many times less the rows must leave with the groups told apart."""
ROUNDS = 12
"""Maximum number of refits."""


@beside("rows that lie off together", "")
def together_off(fit: Fit) -> str:
    """`30 of 90 fitted rows lie 3 mm off the others together (every 3rd, from row 0)`; empty without any."""
    problem = fit.problem
    data, points = problem.data, problem.data.position
    if points is None or len(data.sessions) > 1 or not np.isfinite(points).all() or problem.robot.effects:
        return ""

    def left(x: np.ndarray) -> np.ndarray:
        return points - chains.poses(problem.robot_at(x).chain, data.q)[:, :3, 3]

    before = off = left(fit.x)
    along = (off - off.mean(0)) @ np.linalg.svd(off - off.mean(0), full_matrices=False)[2][0]
    away = _halves(along)
    if _within(along, away) > BIMODAL * along.var():
        return ""
    for _ in range(ROUNDS):
        shift = off[away].mean(0) - off[~away].mean(0)
        moved = replace(data, position=points - away[:, None] * shift)
        off = left(Opt2(limit=20).search(problem.again(data=moved)).x)
        shift = off[away].mean(0) - off[~away].mean(0)
        new = (off @ shift) > 0.5 * ((off[away].mean(0) + off[~away].mean(0)) @ shift)
        if (new == away).all() or min(new.sum(), (~new).sum()) < max(MIN_ROWS, MIN_SHARE * len(new)):
            break
        away = new
    few = away if away.sum() <= len(away) / 2 else ~away
    after = _spread(off, few)
    if CLEAR * after > _size(before) or few.sum() < max(MIN_ROWS, MIN_SHARE * len(few)):
        return ""
    shift = off[few].mean(0) - off[~few].mean(0)
    return (
        f"{few.sum()} of {len(few)} fitted rows lie {in_mm(float(np.linalg.norm(shift)))} off the others "
        f"together ({_which(data.row, few)}), by {', '.join(f'{1e3 * v:.2f}' for v in shift)} mm in x, y, z: "
        "another reflector, station or tool? told apart by a column 'session' the rows leave "
        f"{in_mm(after)}"
    )


def _which(row: np.ndarray, few: np.ndarray) -> str:
    """`every 3rd, from row 0`, or the rows."""
    rows = row[few]
    step = int(np.gcd.reduce(np.diff(rows)))
    if step > 1 and ((row % step == rows[0] % step) == few).all():
        ending = {1: "st", 2: "nd", 3: "rd"}.get(step % 10 if step % 100 not in (11, 12, 13) else 0, "th")
        return f"every {step}{ending}, from row {rows[0] % step}"
    return f"rows {ranges(rows)}"


def _halves(along: np.ndarray) -> np.ndarray:
    """Two groups along one direction, by the cut that leaves least within them."""
    order = np.argsort(along)
    sums, squares = np.cumsum(along[order])[:-1], np.arange(1, len(along))
    total, rest = along.sum(), len(along) - squares
    between = sums**2 / squares + (total - sums) ** 2 / rest
    return np.argsort(order) > int(np.argmax(between))


def _within(along: np.ndarray, away: np.ndarray) -> float:
    return float(sum(((along[g] - along[g].mean()) ** 2).sum() for g in (away, ~away)) / len(along))


def _spread(off: np.ndarray, away: np.ndarray) -> float:
    """Root mean square distance from the mean of each group."""
    return _size(off - np.where(away[:, None], off[away].mean(0), off[~away].mean(0)))


def _size(off: np.ndarray) -> float:
    return float(np.sqrt((off**2).sum(1).mean()))

"""Errors that many rows have in common and no arm explains, one sentence each.

Rows of two kinds in one file: a column parts those that have no arm, or no base and tool, in common; or they
lie off the others by one and the same vector, along the measuring frame's axes or the tool's: a reflector in
one of two seats, two stations, a frame that was knocked; or by other constants: two arms of one make. Or all
points are the nominal arm's, drawn out alike: an instrument whose lengths are wrong. A fit is to most of the
rows; data hold its outliers as well.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import chain, combinations_with_replacement, permutations

import numpy as np
from jaxtyping import Bool, Float
from scipy import special

from workbench.arm.effects import JointCoupling
from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.advice import beside
from workbench.base.progress import check_cancelled
from workbench.base.remedy import remedy
from workbench.base.wording import in_mm, ranges
from workbench.data.dataset import Dataset
from workbench.data.observation import Channel
from workbench.data.postures import repeats
from workbench.data.readers.column_meanings import CHOOSE_ON_PAGE
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import thinned
from workbench.identification.errors.expected_deviation import MAX_DEVIATION
from workbench.identification.fit import Fit
from workbench.identification.meaning.placement import place
from workbench.identification.meaning.usable_rows import usable
from workbench.identification.problem import LinearisedProblem, Problem
from workbench.identification.rows.course import course
from workbench.identification.rows.outlying_rows import robust_fit

MIN_PART, MIN_MOVED, MANY = 10, 4, 100
"""Minimum number of rows of a part, of one with a base of its own, and the number that is enough."""
PARTED, ALIKE = 0.5, 1.3
"""Ratio of errors that parts by themselves leave at most, and up to which base and tool alone explain it."""
LOOSER = 0.1
"""Factor of the prior's weight: the noise that it was weighed against was found with all parts together."""
WORSE, MOST_WORSE, WORSE_CHANCE = 3.0, 0.4, 1e-3
"""Ratio of errors from which on rows are called bad, their maximum share, and the chance of a false call."""
BIMODAL = 0.2
"""Maximum share of the residuals' variance along their widest direction that two groups leave: of normal ones
they leave 0.36, of uniform ones 0.25."""
MIN_IN_TWO, MIN_SHARE = 30, 0.1
"""Minimum number of rows, and their minimum share in either group: fewer are outliers."""
ROUNDS, ROUNDED = 8, 5e-6
"""Maximum number of refits, so that geometry takes no part of the vector; a distance [m] of rounding."""
EXPLAINED, DELAYED, CHANCE = 0.5, 0.7, 1e-3
"""Share of an error that a scale or a following joint must leave at most, a delay, and their chance if there
is none."""
TWO_ARMS, PLAYS = 0.3, 2.0
"""Share of an error that constants of two arms must leave at most, and how often as much one joint
alone, at least: where rows are of one kind 0.38 and more are left, where a joint plays as much."""
COMPUTED = 1e-5
"""Share of the reach up to which an arm meets rows that were computed with it, as it does none of another."""
TWO_SEEN, TWO_ROUNDS = 1e-4, 20
"""Smallest singular value of what rows determine, relative, and the maximum number of steps."""
TOLD = 0.1
"""Size of what rows show of a move, as a share of the largest, from which on it is told."""
LONG, MAX_DRAWN = ("long", "short"), 0.025
"""Half of the largest strain of an instrument's axes."""
MIN_SCALED, MIN_SCALE, MIN_SPREAD = 20, 8e-3, 0.05
"""Fewest rows that tell a scale, the smallest one that is named (two long links that err alike by 2 mm make
0.5 %), and the smallest spread of the points as a share of the reach."""


@beside("columns that part the rows", "")
def parted_by_column(fit: Fit, data: Dataset, *, few: bool = False) -> str:
    """`rows with the same 'robot' need constants of their own, which leave A 5 %, B 6 % of …`, or empty.

    Errors are predicted from the other rows, to first order about the fit: parts drawn by lot are predicted
    worse by themselves, since fewer rows determine as many constants. `few`: those of few rows are asked,
    too, which tell a base of their own alone.
    """
    columns = dict(data.unread)
    if data.session is not None and len(data.sessions) > 1:
        columns["session"] = data.session
    if not columns or data.readings is not None or (held := _with_effects_held(fit, data)) is None:
        return ""
    problem, x = held
    residual, jacobian = (part[: problem.size] for part in problem.evaluate(x))
    prior, posture = fit.problem.prior_at(fit.x), repeats(data)
    prior = prior._replace(jacobian=prior.jacobian[:, np.isin(fit.problem.names, problem.names)])
    kinds = np.array([re.split(r"[.[]", name)[0] for name in problem.names])
    for heading, cells in columns.items():
        check_cancelled()
        rows = {value: np.flatnonzero(cells == value) for value in dict.fromkeys(cells.tolist())}
        rows = {value: own[np.unique(posture[own], return_index=True)[1]] for value, own in rows.items()}
        is_few = few and sum(len(own) >= MIN_PART for own in rows.values()) < 2
        least, frames = MIN_MOVED if is_few else MIN_PART, np.isin(kinds, ("base", "tool")[: 2 - is_few])
        rows = {value: own[:: 1 + len(own) // MANY] for value, own in rows.items() if len(own) >= least}
        if len(rows) < 2 or (is_few and not frames.any()):
            continue
        parts = np.array([np.isin(problem.component_rows, own) for own in rows.values()])
        used = parts.any(0) & (problem.inverse_sigma > 0.0)
        known = LinearisedProblem(residual[used], jacobian[used]), prior, parts[:, used]
        together, moved = (_predicted(*known, own) for own in (frames & False, frames))
        apart = moved if is_few else _predicted(*known, frames | True)
        is_moved = moved @ moved < ALIKE**2 * (apart @ apart) or is_few
        best = moved if is_moved else apart
        if best @ best > PARTED**2 * (together @ together):
            continue
        sizes = [np.sqrt(np.mean(np.square(off))) for off in (*(best[p] for p in parts[:, used]), together)]
        shares = [f"{v or 'blank'} {size / sizes[-1]:.0%}" for v, size in zip(rows, sizes, strict=False)]
        said = remedy(f"give columns='session={heading}' (--columns)", page=f"{CHOOSE_ON_PAGE}: session")
        own = "a base" if is_few else "a base and tool" if is_moved else "constants"
        return (
            f"rows with the same '{heading}' need {own} of their own, which leave {', '.join(shares[:4])} of "
            f"the error that they have together: {said if is_moved else 'another arm? fit them one by one'}"
        )
    return ""


@beside("columns that mark bad rows", "")
def worse_by_column(fit: Fit, data: Dataset, columns: Mapping[str, np.ndarray]) -> str:
    """`rows whose 'Valid' is 0 (20 of 60) are 50 times as far off as the others …`, or empty; beside columns
    the seats that a tip or a ball was put into are asked.

    Where a value tells nothing of the errors, its rows' ranks in a robust fit to all are anyone's.
    """
    columns = columns if data.contact is None else {**columns, "contact": data.contact}
    if not columns or data.readings is not None or (held := _with_effects_held(fit, data)) is None:
        return ""
    (problem, x), (worst, found) = held, (WORSE, "")
    sizes = robust_fit(problem.with_deviation(MAX_DEVIATION), x)[1]
    off, posture = (sizes / np.maximum(np.median(sizes, axis=0), 1e-9)).max(1), repeats(data)
    pairs = [(name, value) for name, cells in columns.items() for value in dict.fromkeys(cells.tolist())]
    for name, value in pairs:
        bad = marked = columns[name] == value
        once = np.unique(2 * posture + bad, return_index=True)[1]
        size, bad = off[once], bad[once]
        excess = np.sum(size.argsort().argsort()[bad] - (len(bad) - 1) / 2.0)
        chance = special.ndtr(-excess / np.sqrt(bad.sum() * (~bad).sum() * (len(bad) + 1) / 12.0 + 1e-9))
        if bad.mean() > MOST_WORSE or chance > WORSE_CHANCE / len(pairs):
            continue
        if (ratio := float(np.median(size[bad]) / np.median(size[~bad]))) > worst:
            which = ",".join(map(str, data.row[marked]))
            said = remedy(f"--exclude {which}", page=f"exclude rows {which} in the Calibrate tab")
            text = f"rows whose '{name}' is {value or 'blank'} ({marked.sum()} of {len(marked)}) are"
            why = "is their seat loose? Leave" if columns[name] is data.contact else "if they are bad, leave"
            leave = f"{ratio:.2g} times as far off as the others: {why} them out:"
            worst, found = ratio, f"{text} {leave} {said} ({data.counted})"
    return found


def _with_effects_held(fit: Fit, data: Dataset) -> tuple[Problem, Float[np.ndarray, " p"]] | None:
    """The problem of rows with all effects as they were found, of which there may be hundreds, and its
    solution; None if rows have unknowns that the fit doesn't know."""
    held = fit.problem.robot.with_effects(*fit.arm.effects)
    problem = fit.problem.again(robot=held, data=data, effects=())
    is_known = {*problem.names} <= {*fit.problem.names}
    return (problem, problem.at(fit.problem.named(fit.x))) if is_known else None


def _predicted(
    rows: LinearisedProblem,
    prior: LinearisedProblem,
    parts: Bool[np.ndarray, "n m"],
    own: Bool[np.ndarray, " p"],
) -> Float[np.ndarray, " m"]:
    """Residuals as predicted from the other rows, if every part has some unknowns of its own."""

    def spread(matrix: np.ndarray, parts: np.ndarray) -> np.ndarray:
        return np.concatenate([matrix[:, ~own], *(part[:, None] * matrix[:, own] for part in parts)], axis=1)

    count, looser = len(parts), LOOSER / np.sqrt(len(parts))
    known = spread(np.tile(prior.jacobian, (count, 1)), np.repeat(np.eye(count), len(prior.residual), axis=1))
    whole = np.concatenate([spread(rows.jacobian, parts), looser * known])
    wanted = np.concatenate([rows.residual, looser * np.tile(prior.residual, count)])
    whole /= np.maximum(np.linalg.norm(whole, axis=0), 1e-12)
    values, vectors = np.linalg.eigh(whole.T @ whole)
    seen = values > 1e-12 * values[-1]
    basis = whole @ (vectors[:, seen] / np.sqrt(values[seen]))
    left = wanted - basis @ (basis.T @ wanted)
    return (left / np.maximum(1.0 - (basis**2).sum(1), 1e-3))[: len(rows.residual)]


def _by_joints(fit: Fit, motion: Float[np.ndarray, "rows n k"]) -> tuple[np.ndarray, ...]:
    """`_explained` by k motions of the joints, for the rows of `thinned`."""
    problem = thinned(fit.problem)
    found = problem.again(robot=fit.arm, known={**problem.known, **problem.instrument(fit.x)})
    joints = -np.vstack([problem.whiten(b, b.by_joint).reshape(-1, motion.shape[1]) for b in found.blocks])
    return _explained(fit, problem, np.einsum("mj,mjk->mk", joints, motion[problem.component_rows]))


def _explained(
    fit: Fit, problem: Problem, columns: Float[np.ndarray, "m k"], held: np.ndarray | None = None
) -> tuple[np.ndarray, ...]:
    """What a geometry leaves of some rows, to first order about its fit, and what k columns do that no
    constant, nor what is held, imitates; what share of the error each leaves, and its chance."""
    residual, own = (part[: problem.size] for part in problem.evaluate(fit.x))
    own = own if held is None else np.hstack([own, held])
    own = own / np.maximum(np.linalg.norm(own, axis=0), 1e-12)
    left, ways = (part - own @ np.linalg.lstsq(own, part, rcond=1e-6)[0] for part in (residual, columns))
    gained = (left @ ways) ** 2 / np.maximum((ways**2).sum(0), 1e-12)
    share = np.sqrt(np.maximum(1.0 - gained / (left @ left + 1e-30), 1e-12))
    spare = max(len(left) - int(np.linalg.matrix_rank(own, tol=1e-6)) - 1, 1)
    return left, ways, share, special.fdtrc(1, spare, spare * (share**-2.0 - 1.0))


@beside("joints that follow others", "")
def following(fit: Fit) -> str:
    """`joint 3 moves along with joint 4, which leaves 9 % of …`, or empty."""
    q, pairs = thinned(fit.problem).data.q, [*permutations(range(fit.problem.robot.dof), 2)]
    motion = np.stack([np.eye(q.shape[1])[i] * q[:, [j]] for i, j in pairs], axis=2)
    *_, shares, chances = _by_joints(fit, motion)
    best = int(shares.argmin())
    if shares[best] > EXPLAINED or len(pairs) * chances[best] > CHANCE:
        return ""
    leaves = f"which leaves {100.0 * shares[best]:.2g} % of what the geometry does"
    return f"{JointCoupling(pairs[best]).plain}, {leaves}: find it with 'workbench diagnose'"


@beside("whether joints and places are of one time", "")
def lag(fit: Fit, data: Dataset) -> str:
    """`what the geometry leaves is as if the arm was measured 10 ms after its joints were read …`, or empty;
    play, which moves each joint by the direction of its speed alone, must leave more."""
    came = course(thinned(fit.problem).data, data)
    if not came.is_steady or data.readings is not None:
        return ""
    plays = np.sign(speed := came.speed[:, :, None]) * np.eye(fit.problem.robot.dof)
    left, ways, (share, *_), (chance, *_) = _by_joints(fit, np.concatenate([speed, plays], axis=2))
    played = left - ways[:, 1:] @ np.linalg.lstsq(ways[:, 1:], left, rcond=1e-6)[0]
    if share > DELAYED or chance > CHANCE or played @ played < share**2 * (left @ left):
        return ""
    text = came.text(-float(left @ ways[:, 0]) / float(ways[:, 0] @ ways[:, 0]))
    text += f"; one delay leaves {100.0 * share:.2g} % of it"
    return f"what the geometry leaves is {text}: give joints and places of one time, or measure at rest"


def two_kinds(fit: Fit, data: Dataset) -> str:
    """That some rows lie off the others together, or else are another arm's; empty if they don't."""
    return two_places(fit, data) or two_arms(fit, data)


@beside("rows of two arms", "")
def two_arms(fit: Fit, data: Dataset) -> str:
    """`40 of 80 rows (rows 1, 3, …) need constants of their own, which leave 5 % of …`, or empty; not where
    one joint's zero and axis explain as much, as if it or its bearing plays.

    To first order about the fit e = J s δ, where s is 0 or 1 for each posture. Begun along the direction in
    which the postures' gradients Jᵀ e spread most, s and δ are found in turn.
    """
    problem = thinned(fit.problem)
    residual, own = (part[: problem.size] for part in problem.evaluate(fit.x))
    posture = np.unique(repeats(problem.data), return_inverse=True)[1]
    rows, dof = posture[problem.component_rows], problem.robot.dof
    own, sizes, _ = np.linalg.svd(own / np.maximum(np.linalg.norm(own, axis=0), 1e-12), full_matrices=False)
    own = own[:, sizes > TWO_SEEN * sizes[0]]
    spare = len(residual) - 2 * (count := own.shape[1])
    left, gradients = residual - own @ (own.T @ residual), np.zeros((rows.max() + 1, count))
    np.add.at(gradients, rows, own * left[:, None])
    if spare < count or len(gradients) < MIN_IN_TWO:
        return ""
    away = gradients @ np.linalg.eigh(gradients.T @ gradients)[1][:, -1] > 0.0
    for _ in range(TWO_ROUNDS):
        part = own[away[rows]].T @ own[away[rows]]
        step = np.linalg.solve(part - part @ part + 1e-6 * np.eye(count), gradients[away].sum(0))
        off = left + own @ (part @ step)
        each = np.array([np.bincount(rows, e**2) for e in (off, off - own @ step)])
        if (away == (away := each[1] < each[0])).all():
            break
    share = float(np.sqrt(each.min(0).sum() / spare * (len(residual) - count) / (left @ left + 1e-30)))
    if share > TWO_ARMS or not MIN_SHARE < away.mean() < 1.0 - MIN_SHARE:
        return ""
    left, ways, *_ = _by_joints(fit, away[posture][:, None, None] * np.eye(dof))
    own = away[rows, None] * problem.evaluate(fit.x).jacobian[: problem.size]
    whose = np.array([*range(1, dof + 1), *(_joint_of(name, dof) for name in problem.names)])
    ways = np.hstack([ways, _explained(fit, problem, own)[1]])
    for j in range(1, dof + 1):  # play of a joint, or of its bearing
        near = ways[:, (whose == j) | (whose == j - 1)]
        off = left - near @ np.linalg.lstsq(near, left, rcond=1e-6)[0]
        if np.linalg.norm(off) < PLAYS * share * np.linalg.norm(left):
            return ""
    few = (away if away.mean() <= 0.5 else ~away)[posture]
    if computed := _computed(fit, data, few) or _computed(fit, data, ~few):
        return computed
    which = f"{few.sum()} of {len(few)} fitted rows (rows {ranges(problem.data.row[few])})"
    leave = f"{100.0 * share:.2g} % of the error that all have together"
    why = "another arm's, or of another time? Fit them by themselves"
    return f"{which} need constants of their own, which leave {leave}: {why}"


def _joint_of(name: str, dof: int) -> int:
    """The joint of a constant, from 1; 0 for the base, and behind the last one."""
    found = re.match(r"joint(\d+)\.", name)
    return int(found[1]) if found else dof + 1 if name.startswith("tool") else 0


def _computed(fit: Fit, data: Dataset, some: Bool[np.ndarray, " n"]) -> str:
    """`26 of 80 rows were computed with the nominal arm …`, if with one base and tool it meets most of some
    rows as it meets no measured ones; or empty."""
    part, robot = thinned(fit.problem).data.take(np.flatnonzero(some)), fit.problem.robot.bare
    if part.position is None or data.position is None:
        return ""
    at, most = place(robot, part.q[None], part.position[None], None), COMPUTED * robot.reach
    if np.median(at.error) > most:
        return ""
    frames = at.base[0], at.tool[0]
    met = place(robot, data.q[None], data.position[None], None, given=frames).error[0] < most
    which = ",".join(map(str, data.row[met]))
    said = remedy(f"--exclude {which}", page=f"exclude rows {which} in the Calibrate tab")
    met_by = f"computed with the nominal arm, which meets them to {in_mm(most)}"
    return f"{met.sum()} of {len(met)} rows were {met_by}: leave them out: {said} ({data.counted})"


@beside("what is wrong with the instrument", "")
def distorted(fit: Fit) -> str:
    """`distances from the measuring frame's origin are 17 mm too long …`, or empty; likewise an axis of the
    frame that is drawn out, or two that aren't square; first, that a held base or tool is elsewhere."""
    problem = thinned(fit.problem)
    places = [[c is Channel.POSITION for c in b.observation.channels] for b in problem.blocks]
    if (points := problem.data.position) is None or any(sum(own) != 3 for own in places):
        return ""
    if np.linalg.norm(np.nanstd(points, axis=0)) < MIN_SPREAD * problem.robot.reach:
        return ""
    pairs = [*combinations_with_replacement(range(3), 2)] + [(0, 0)] * bool(problem.frames.base)
    moved = np.stack([points[:, [i]] * np.eye(3)[j] + points[:, [j]] * np.eye(3)[i] for i, j in pairs], 2)
    moved[:, :, 6:] = (points / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1e-9))[:, :, None]
    turned = tool_poses(fit.arm.in_session(problem.data.sessions[0]), Motion.of(problem.data))[:, :3, :3]
    about = points - np.nanmean(points, axis=0)
    moves = {"base": [0.0 * turned + np.eye(3), -se3.skew(about)], "tool": [turned]}
    moves = {name: move for name, move in moves.items() if not getattr(problem.frames, name)}
    columns, moved = [], np.concatenate([moved, *chain(*moves.values())], axis=2)
    for block, own in zip(problem.blocks, places, strict=True):
        table = np.zeros((*block.inverse_sigma.shape, moved.shape[2]))
        table[:, own] = np.nan_to_num(moved[block.rows])
        columns.append(problem.whiten(block, table).reshape(-1, moved.shape[2]))
    every, held = np.split(np.concatenate(columns), [len(pairs)], axis=1)
    left, ways, shares, chances = _explained(fit, problem, every, held)
    if moves:
        alone, at, *_ = _explained(fit, problem, held)
        freed, spare = held.shape[1], max(len(left) - len(fit.x) - held.shape[1], 1)
        share = float(np.linalg.norm(left) / (np.linalg.norm(alone) + 1e-15))
        if share < EXPLAINED and special.fdtrc(freed, spare, spare / freed * (share**-2.0 - 1.0)) < CHANCE:
            off, names = np.linalg.norm(np.linalg.lstsq(at, alone, rcond=TOLD)[0][:3]), " and ".join(moves)
            text = f"with the {names} {in_mm(float(off))} elsewhere the geometry leaves {100.0 * share:.2g} %"
            return f"{text} of that: correct [{names.replace(' and ', '] and [')}], or set free = true there"
    best, way = int(shares.argmin()), ways[:, shares.argmin()]
    size, (i, j) = float(left @ way / (way @ way)), pairs[best]
    is_sure = shares[best] < EXPLAINED and len(pairs) * chances[best] < CHANCE
    if not is_sure or (best < 6 and abs(size) > MAX_DRAWN):
        return ""
    what = f"distances from the measuring frame's origin are {in_mm(abs(size))} too {LONG[size < 0.0]}"
    why = "does its prism or reflector have another constant"
    if best < 6:
        (a, b), why = ("xyz"[i], "xyz"[j]), "is the instrument calibrated"
        drawn = f"is {200.0 * abs(size):.2g} % too {LONG[size < 0.0]}"
        what = f"{a} of the measuring frame {drawn}"
        if a != b:
            what = f"{a} and {b} of the measuring frame are {2e3 * abs(size):.2g} mrad off square"
    leaves = f"which alone leaves {100.0 * shares[best]:.2g} % of what the geometry does"
    return f"{what}, {leaves}: {why}? Correct the file"


@beside("rows that lie off together", "")
def two_places(fit: Fit, data: Dataset) -> str:
    """`30 of 90 rows (every 3rd, from row 0) lie 3 mm off the others together …`, or empty."""
    problem, points, motion = fit.problem, data.position, Motion.of(data)
    if points is None or len(data) < MIN_IN_TWO or len(data.sessions) > 1 or not np.isfinite(points).all():
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
    shift = left[few].mean(0) - left[~few].mean(0)
    if share > BIMODAL or few.mean() < MIN_SHARE or np.linalg.norm(shift) < ROUNDED:
        return ""
    known = [(n, v) for n in ("payload", "temperature") if (v := getattr(data, n)) is not None]
    told = [n for n, v in known if (v[few].min() - v[~few].max()) * (v[few].max() - v[~few].min()) > 0.0]
    more = f"the {told[0]} tells them apart" if told else "tell them apart by a column 'session'"
    return (
        f"{few.sum()} of {len(few)} rows (rows {ranges(data.row[few])}) lie "
        f"{in_mm(float(np.linalg.norm(shift)))} off the others together, by "
        f"{', '.join(f'{1e3 * v:.2f}' for v in shift)} mm in x, y, z of {axes}: "
        f"another reflector, seat, station or tool, or a knock? {more}"
    )


def _halves(off: Float[np.ndarray, "rows 3"]) -> tuple[float, Bool[np.ndarray, " rows"]]:
    """Two groups along the widest direction, by the cut that leaves least within them, and what share."""
    along = (off - off.mean(0)) @ np.linalg.svd(off - off.mean(0), full_matrices=False)[2][0]
    order, count = np.argsort(along), np.arange(1, len(along))
    between = np.cumsum(along[order])[:-1] ** 2 * (1.0 / count + 1.0 / (len(along) - count))
    best = int(np.argmax(between))
    return 1.0 - float(between[best] / (along @ along)), np.argsort(order) > best


@beside("the instrument's scale", "")
def instrument_scale(aligned: Robot, data: Dataset) -> str:
    """`all lengths are 2 % longer than nominal …`, or empty.

    Manufacturing errors lengthen some links and shorten others, and turn axes; a board that was printed too
    large, or a camera's wrong focal length, does the same to all lengths at once. The nominal arm is aligned
    with the rows, to first order; pictures themselves have checks of their own (`extras/camera`).
    """
    rows = usable(data) if data.position is not None else None
    if rows is None or len(rows) < MIN_SCALED:
        return ""
    arm = aligned if rows.session is None else aligned.in_session(str(rows.session[0]))
    seen = tool_poses(arm, Motion.of(rows))
    points, turned = seen[:, :3, 3] - seen[:, :3, 3].mean(0), seen[:, :3, :3]
    if np.linalg.norm(points.std(0)) < MIN_SPREAD * aligned.reach:
        return ""
    off = (np.asarray(rows.position) - seen[:, :3, 3]).ravel()
    frames = [-se3.skew(points), np.broadcast_to(np.eye(3), turned.shape), turned]
    free = np.concatenate(frames, axis=2).reshape(len(off), -1)
    apart = lambda table: table - free @ np.linalg.lstsq(free, table, rcond=None)[0]  # noqa: E731
    rest, drawn = apart(np.column_stack([off, points.ravel()])).T
    scale, size = float(drawn @ rest / (drawn @ drawn)), np.sqrt(3.0 / len(off))
    without, left = (float(size * np.linalg.norm(v)) for v in (rest, rest - scale * drawn))
    if not (left < EXPLAINED * without and MIN_SCALE < abs(scale) < 1.0):
        return ""
    ways = apart(identification_jacobian(arm, Motion.of(rows))[1][:, :3].reshape(len(off), -1))
    alone = (ways.T @ rest) ** 2 / np.maximum((ways**2).sum(0), 1e-12)
    if size**2 * (rest @ rest - alone.max()) < left**2:  # one constant is nearer
        return ""
    return (
        f"all lengths are {100.0 * abs(scale):.2g} % {'longer' if scale > 0.0 else 'shorter'} than nominal, "
        f"which leaves {1e3 * left:.3g} of {1e3 * without:.3g} mm (rms): rather the instrument's scale (size "
        "of its board, camera calibration, unit) than the arm; measure a known distance with it"
    )

"""What is said of rows that no reading explains: which parts fit, as where instrument, robot or tool were
moved; or with which constant of the arm's table all fit, if it is wrong."""

from dataclasses import replace
from itertools import islice, product
from typing import Any

import numpy as np

from workbench.arm import chain as chains
from workbench.arm.conventions import ORDERS
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.robot import Robot
from workbench.arm.robot_toml import robot_from_rows, robot_to_table
from workbench.base.remedy import remedy
from workbench.base.wording import in_mm, joint_list, plural, ranges
from workbench.data.dataset import Dataset
from workbench.data.postures import postures
from workbench.data.readers.column_meanings import CHOOSE_ON_PAGE
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.meaning.bounds import WEIGHT, flange_poses, point_bounds
from workbench.identification.meaning.meaning import RowMeaning
from workbench.identification.meaning.placement import place
from workbench.identification.meaning.reading import FITS, NARROW, RowReading, units
from workbench.identification.meaning.search import CLEAR
from workbench.identification.meaning.usable_rows import PLACED_ROWS, far_apart, usable
from workbench.identification.problem import FrameFreedom, Noise, Problem

MIN_FITTING_SHARE, TRIM_ROUNDS = 0.65, 8
"""Share of rows that must fit for the others to be wrong, and number of rounds that search for them."""
MIN_PART = 10
"""Minimum number of rows of a part: with fewer, base and point of the tool fit too much."""
WITHIN, FAR = 0.5 * FITS, 8.0
"""Misfit of a part as a share of the reach, and of a row beside its part's own."""
STEPS, UNIT, MAX_UNITS = 30, 1e-4, 256
"""Maximum steps of a fit, its noise as a share of the reach, and choices of joints in another unit."""
ALIKE = 1.3
"""Ratio of misfits within which other constants are named as well."""
MOVED = "name what was moved in between in a column 'session', or correct the rows"
Told = dict[str, Any]
"""Fields of a meaning that an explanation gives; empty: it doesn't explain the rows."""


def explained(robot: Robot, data: Dataset, meaning: RowMeaning) -> RowMeaning:
    """The meaning of rows of which some or all don't fit, with the first explanation of them."""
    all_fit = meaning.is_found and not (meaning.best.apart and meaning.best.is_plain)
    if all_fit or data.joints != robot.dof or (rows := usable(data)) is None:
        return meaning
    some = EXPLANATIONS[:1] if meaning.is_found else EXPLANATIONS
    found = (explain(robot, rows, meaning) for explain in some)
    return replace(meaning, **next(filter(None, found), {}))


def _by_column(robot: Robot, rows: Dataset, meaning: RowMeaning) -> Told:
    """What a column that was left out tells of them: by its values they fit by themselves, or those of one of
    two."""
    for heading, cells in rows.unread.items():
        parts = {value: rows.take(cells == value) for value in dict.fromkeys(cells.tolist())}
        fits = {v: own for v, own in parts.items() if len(own) >= MIN_PART and _fits(robot, own)}
        if len(parts) < 2 or sum(map(len, fits.values())) < MIN_FITTING_SHARE * len(rows):
            continue
        sizes = ", ".join(f"{v or 'blank'} fit to {in_mm(_misfit(robot, own))}" for v, own in fits.items())
        if len(fits) == 1:
            ((value, kept),) = fits.items()
            off = placed_errors(robot, kept, rows.take(cells != value)) > WITHIN * robot.reach
            if off.mean() < MIN_FITTING_SHARE:  # others fit as well: it tells nothing of those that don't
                continue
            return {"told": f"those whose '{heading}' is {sizes}, the others don't", "kept": (heading, value)}
        if not meaning.is_found:
            key = "point" if len(np.unique(postures(rows.q))) < MIN_FITTING_SHARE * len(rows) else "session"
            text = f"rows with the same '{heading}' fit with a base and tool of their own ({sizes})"
            said = remedy(f"give columns='{key}={heading}' (--columns)", page=f"{CHOOSE_ON_PAGE}: {key}")
            return {"told": text, "cure": said}
    return {}


def _positions_alone(robot: Robot, rows: Dataset, meaning: RowMeaning) -> Told:
    """That only their orientations are in another frame."""
    if rows.rotation is None or not _fits(robot, rows):
        return {}
    text = f"the positions alone fit to {in_mm(_misfit(robot, rows))}, the orientations in another frame"
    cure = "correct them, or leave their columns out" + remedy(", columns='rx=-,…' (--columns)", page="")
    return {"told": text, "cure": cure}


def _other_convention(robot: Robot, rows: Dataset, meaning: RowMeaning) -> Told:
    """`with convention = "craig" the numbers of its table fit to 0.87 mm`."""
    other = dict(zip(ORDERS, [*ORDERS][::-1], strict=True)).get(robot.convention, "")
    if not other or not _fits(arm := robot_from_rows(robot_to_table(robot.bare)["joint"], other), rows):
        return {}
    text = f'with convention = "{other}" the numbers of its table fit to {in_mm(_misfit(arm, rows))}'
    return {"told": text, "cure": f'write convention = "{other}" in the robot\'s table'}


def _otherwise(robot: Robot, rows: Dataset, meaning: RowMeaning) -> Told:
    """`with the joints of the row before they fit to 1.5 mm`, or with some joints or all in another unit."""
    some, factor = np.arange(len(rows) - 1), units(robot, robot.dof, 180.0 / np.pi)
    picked = np.array([*islice(product((1, 0), repeat=robot.dof), MAX_UNITS)])  # all joints come first
    few = rows.take(far_apart(rows, PLACED_ROWS))
    factors = np.concatenate([factor**picked, factor**-picked])
    flange = flange_poses(robot.bare, factors[:, None] * few.q)
    wide = np.linalg.norm(flange[..., :3, 3].std(1), axis=1) + UNIT * robot.reach
    is_near = point_bounds(flange, np.asarray(few.position)) < WITHIN * wide
    shift = "shift joints or places by one row, or add the row that is missing"
    before, after = (replace(rows.take(a), q=rows.q[b]) for a, b in ((some + 1, some), (some, some + 1)))
    ways = [(before, "the joints of the row before", shift), (after, "the joints of the row after", shift)]
    turned = [(each, replace(rows, q=each * rows.q)) for each in factors[is_near & (factors != 1.0).any(1)]]
    errors = [_misfit(robot, own) for _, own in turned]
    alike = (pair for pair, off in zip(turned, errors, strict=True) if off <= ALIKE * min(errors))
    for each, own in sorted(alike, key=lambda pair: (pair[0] != 1.0).sum() % robot.dof)[:1]:  # or all joints
        how = "in rad, not degrees," if each.max() > 1.0 else "in degrees, not rad,"
        ways.append((own, f"{joint_list(np.flatnonzero(each != 1.0).tolist())} {how}", "correct their unit"))
    for own, how, cure in ways if len(some) >= MIN_PART else ():
        if _fits(robot, own):
            return {"told": f"with {how} they fit to {in_mm(_misfit(robot, own))}", "cure": cure}
    return {}


def _most(robot: Robot, located: Dataset, meaning: RowMeaning) -> Told:
    """`12 rows (10–21) don't fit the others, which the arm fits to 2.6 mm`, if it fits most."""
    off = np.zeros(len(located))
    for _ in range(TRIM_ROUNDS):
        most = located.take(np.flatnonzero(off <= np.quantile(off, MIN_FITTING_SHARE)))
        some = most.take(far_apart(most, PLACED_ROWS))
        off = placed_errors(robot, some, located)
    fits = off < FITS * robot.reach
    error = float(np.median(off[fits])) if fits.any() else np.inf
    if not MIN_FITTING_SHARE <= fits.mean() < 1.0 or error > 0.5 * FITS * robot.reach:
        return {}
    few = f"{plural(int((~fits).sum()), 'row')} ({ranges(located.row[~fits].tolist())})"
    few += f" {'doesn' if (~fits).sum() == 1 else 'don'}'t fit the others"
    places = np.unique(np.asarray(located.position)[~fits], axis=0)
    frozen = "; the instrument's reading stays the same in them" if 2 * len(places) <= (~fits).sum() else ""
    cure = "correct the units or joints of these rows, or exclude them"
    return {"told": f"{few}, which the arm fits to {in_mm(error)}{frozen}", "cure": cure}


def placed_errors(robot: Robot, some: Dataset, data: Dataset) -> np.ndarray:
    """Distances of points [m] from an arm that is placed by some rows."""
    at = place(robot.bare, some.q[None], np.asarray(some.position)[None], None)
    poses = at.base[0] @ chains.poses(robot.bare.chain, data.q) @ at.tool[0]
    return np.linalg.norm(poses[:, :3, 3] - data.position, axis=1)


def _in_order(robot: Robot, data: Dataset, meaning: RowMeaning) -> Told:
    """`data rows 0–29 fit to 1.5 mm, 30–59 to 1.6 mm elsewhere`, if either end fits by itself."""
    for rows, where in ((data, "after"), (data.take(np.arange(len(data))[::-1]), "before")):
        found = list[str]()
        while len(rows) and (length := _part_that_fits(robot, rows)):
            own, rows = rows.take(np.arange(length)), rows.take(np.arange(length, len(rows)))
            size = f"{'fit ' * (not found)}to {in_mm(_misfit(robot, own))}"
            found.append(f"{own.row.min()}–{own.row.max()} {size}")
        if len(found) > 1 or (found and len(rows)):
            end = f", those {where} them don't" if len(rows) else " with another base or tool"
            other = _most(robot, data, meaning) if len(rows) else {}
            if len(rows) and (shift := _otherwise(robot, rows.take(np.argsort(rows.row)), meaning)):
                return shift | {"told": f"data rows {', '.join(found)}{end}: {shift['told']}"}
            return other or {"told": f"data rows {', '.join(found)}{end}", "cure": MOVED}
    return {}


def _part_that_fits(robot: Robot, data: Dataset) -> int:
    """Number of rows at the beginning that fit by themselves, perhaps all; 0 if there is no such part."""
    low, high = MIN_PART, len(data)
    if high < low or not _fits(robot, data.take(np.arange(low))):
        return 0
    if _fits(robot, data):
        return high
    while high - low > 1:  # a few rows more are set apart, and the part still fits
        middle = (low + high) // 2
        low, high = (middle, high) if _fits(robot, data.take(np.arange(middle))) else (low, middle)
    some, reach = data.take(np.arange(max(MIN_PART, int(0.8 * low)))), robot.reach
    near = placed_errors(robot, some, data) < min(WITHIN * reach, FAR * _misfit(robot, some) + UNIT * reach)
    off = [not near[k] and near[k : k + 3].sum() < 2 for k in range(len(near))]
    return int(np.argmax([*off, True]))


def _misfit(robot: Robot, data: Dataset) -> float:
    """Root mean square distance of rows that may set some apart [m]."""
    error = placed_errors(robot, data, data)
    return float(np.sqrt((np.sort(error)[: max(1, int(0.8 * len(data)))] ** 2).mean()))


def _fits(robot: Robot, data: Dataset) -> bool:
    """Whether rows fit, and not clearly worse than those of their first half."""
    wide, half = np.linalg.norm(np.asarray(data.position).std(0)), max(MIN_PART, len(data) // 2)
    beside = FAR / 2 * _misfit(robot, data.take(np.arange(len(data))[:half])) + UNIT * robot.reach
    return _misfit(robot, data) < min(WITHIN * robot.reach, NARROW * float(wide), beside)


def one_constant(robot: Robot, located: Dataset, meaning: RowMeaning) -> Told:
    """`with joint4.d 108.8 instead of 88.8 mm they fit to 0.02 mm`."""
    if (reading := meaning.given) is None:
        return {}
    data = located.take(far_apart(located, PLACED_ROWS))
    arm, rows = reading.robot, reading.apply(data.take(np.delete(np.arange(len(data)), reading.apart)))
    arm = replace(arm, mounting=arm.mounting.at(reading.base, reading.tool))
    freedom, noise = FrameFreedom(FRAME_PARTS, FRAME_PARTS), Noise(UNIT * arm.reach, UNIT / WEIGHT)
    found = list[tuple[RowReading, str]]()
    for name, axis in ((e.name, e.axis) for e in arm.elements if e.matrix is None):
        problem = Problem.build(arm, rows, free=[name], frames=freedom, noise=noise)
        fitted = problem.robot_at(Opt2(limit=STEPS).search(problem).x)
        off = row_errors(fitted, rows)
        position, turn = (float(np.sqrt((e**2).mean())) for e in (off.position, off.rotation))
        unit, factor = ("°", 180.0 / np.pi) if axis.turns else (" mm", 1e3)
        before, after = (factor * float(r.values((name,))[0]) for r in (arm, fitted))
        text = f"{name} {after:.4g} instead of {before:.4g}{unit}"
        found.append((replace(reading, position=position, rotation=turn), text))
    found.sort(key=lambda pair: pair[0].score)
    best = [pair for pair in found if pair[0].score < ALIKE * found[0][0].score + 1e-6]
    nearest = best[0][0]
    if CLEAR * nearest.score > reading.score or not nearest.fits:
        return {}
    return {"told": f"with {' or '.join(text for _, text in best[:2])} they fit to {in_mm(nearest.position)}"}


EXPLANATIONS = (_by_column, _other_convention, _positions_alone, _otherwise, _in_order, _most, one_constant)
"""All in their order; rows that are found, of which some stand off, are asked of their columns alone."""

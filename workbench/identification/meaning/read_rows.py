"""Families of readings in their order, each complete before anything is said."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot import Robot
from workbench.base.assets import built_in_robots
from workbench.data.dataset import Dataset
from workbench.identification.meaning.candidates import ColumnReadings, Families
from workbench.identification.meaning.meaning import RowMeaning, ranked
from workbench.identification.meaning.nominal_fit import majority
from workbench.identification.meaning.reading import FITS, GOOD, NARROW, RowReading
from workbench.identification.meaning.search import FEW_POINTS, SURE, ReadingSearch
from workbench.identification.meaning.unexplained import ELSEWHERE, one_constant, parts_in_order
from workbench.identification.meaning.usable_rows import few_each, usable, without_still_turns

HELD_ROWS = 3
"""Minimum number of full poses of the flange."""
SPARE = 3
"""Maximum number of joint columns that are none of the arm's."""
SLACK = 0.05
"""Tolerance on the joint limits [rad or m]."""


def read_rows(robot: Robot, data: Dataset, *, likely: bool = False) -> RowMeaning | None:
    """What rows mean for an arm; None with too few rows with a point.

    Args:
        robot: The arm that is said to have moved.
        data: Rows; those of the session, and of the point, that has most are looked at.
        likely: Whether only signs, couplings and zeros are tried, of an arm that is known to be this one.
    """
    data = without_still_turns(robot, data)
    rows = usable(data)
    rows, sessions = few_each(data) if rows is None else (rows, 1)
    if not sessions:
        return None
    if data.joints == robot.dof:
        every, arm = ReadingSearch(robot, rows, count=len(rows)), robot.in_session(rows.sessions[0])
        known = every.plain(given=(arm.base.pose, arm.tool.pose))
        if every.suffices(known) and not known.apart:
            return RowMeaning(best=known, plain=known)
    search, plain = ReadingSearch(robot, rows, sessions=sessions), None
    if data.joints == robot.dof:
        if search.suffices(plain := search.plain()):
            return RowMeaning(best=plain, plain=plain)
        search.found = [plain, *search.place([RowReading.plain(robot)])]
        if search.suffices(search.found[1]) and not search.found[1].mirrored:  # signs may do the same
            return ranked(search, plain)
    for number, stage in enumerate(steps := _stages(search, likely)):
        if plain is not None and number and _is_done(search, plain, last=number == len(steps) - 1):
            break
        stage()
    if not search.found:
        return None
    search.twins()
    meaning = ranked(search, plain)
    given = meaning.turned or plain
    if likely or given is None or meaning.is_found or sessions > 1:
        return meaning
    parts = parts_in_order(robot, rows)
    if not parts.endswith(ELSEWHERE) and (most := majority(robot, rows)):
        how = "correct the units or joints of these rows, or exclude them"
        return replace(meaning, parts=most, remedy=how)
    return replace(meaning, parts=parts, constant="" if parts else one_constant(given, search.data))


def _stages(search: ReadingSearch, likely: bool) -> list[Callable[[], None]]:
    """Families in their order."""
    robot, own = search.robot, Families(search.robot, search.data.joints)
    arms: list[Callable[[], None]] = [] if likely else [lambda: _try_arms(search)]
    if own.columns != robot.dof:
        choices = [lambda: search.family("choices of columns", robot, own.plain)]
        return [*(choices if 0 < own.columns - robot.dof <= SPARE else []), *arms]
    near = min(r.position for r in search.found) < FITS * robot.reach

    def first() -> None:
        search.family("signs and couplings", robot, own.signs)
        if (near or likely) and search.sessions == 1:  # a plain reading that fits so-so meets these first
            search.family("exchanges", robot, own.exchanges)
            search.family("zeros", robot, own.zeros, inverse=False)

    def with_zeros(name: str) -> Callable[[], None]:
        return lambda: search.family(name, robot, FAMILIES[name](own), inverse=False)

    zeros = [with_zeros(name) for name in [*FAMILIES][1:]] if search.sessions == 1 or likely else []
    orders = [] if likely else [lambda: search.family("orders", robot, own.orders)]
    return [first, *arms, *orders, *(zeros[:1] if likely else zeros)]


def other_arm(robot: Robot, data: Dataset, limit: float) -> RowReading | None:
    """The built-in arm that fits points, as they are given, best and to less than a limit [m], if any."""
    search = ReadingSearch(robot, replace(data, rotation=None, written=None))
    _try_arms(search)
    fits = (r for r in search.found if r.fits and r.motion < NARROW and r.position < limit)
    return min(fits, key=lambda r: r.score, default=None)


def _try_arms(search: ReadingSearch) -> None:
    """Built-in arms, read plainly; of those that differ in limits alone, within which more rows lie."""
    q = search.data.q
    for name in built_in_robots():
        arm = load_robot(name)
        if arm.dof == q.shape[1] and arm.name.split(",")[0] != search.robot.name.split(",")[0]:
            low, high = arm.limits.T
            outside = ((q < low - SLACK) | (q > high + SLACK)).any(1).mean()
            plain = Families(arm.bare, arm.dof).plain
            plain = replace(plain, cost=plain.cost + outside)
            search.family("other arms", arm.bare, plain, inverse=False, other=name)


FAMILIES: dict[str, Callable[[Families], ColumnReadings]] = {
    "signs and couplings": lambda families: families.signs,
    "zeros with signs": lambda families: families.signed_zeros,
    "couplings with zeros": lambda families: families.coupled_zeros,
    "quarter turns with signs": lambda families: families.quarters,
}


def read_held(robots: Sequence[Robot], data: Dataset) -> RowMeaning:
    """What a few full poses of the flange in the base of an arm mean, which is one of several.

    The arms are bare and share a name; the one that moved is that of the best reading.
    """
    search = ReadingSearch(robots[0], data, held=True)
    arms = [(robot, Families(robot, robot.dof)) for robot in robots]
    for name, candidates in FAMILIES.items():
        for robot, families in arms:
            search.family(name, robot, candidates(families), inverse=False)
        best = min(search.found, key=lambda r: r.score)
        if best.score < search.sure:
            break
    search.found += search.place(search.refined(_turned_back(best, search.data.q)))
    return ranked(search, None)


def _turned_back(reading: RowReading, q: np.ndarray) -> list[RowReading]:
    """A reading with one joint after the other counting the other way about its middle."""
    middle, found = reading.in_units(q).mean(0), []
    for k in range(len(reading.zero)):
        w, zero = reading.w.copy(), reading.zero.copy()
        zero[k] += 2.0 * w[k] @ middle
        w[k] *= -1.0
        found.append(replace(reading, w=w, zero=zero, convention=None))
    return found


def _is_done(search: ReadingSearch, plain: RowReading, *, last: bool) -> bool:
    """Whether what was found is good or clear enough to stop."""
    best = min(r.score for r in search.found)
    few = len(search.data) < FEW_POINTS and not search.conventions
    if best > SURE or (few and best > 1e-3 and not last and not plain.fits):
        return False
    top = ranked(search, plain)
    if top.best.moves_otherwise and top.best.motion > 0.4 * NARROW:
        return False
    return best < GOOD or (top.margin > 3.0 and (bool(search.conventions) or not top.best.moves_otherwise))

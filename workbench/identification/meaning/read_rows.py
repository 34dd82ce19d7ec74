"""Families of readings in their order, each complete before anything is said."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.identification.meaning.families import FAMILIES, OTHER_ARMS, Rows
from workbench.identification.meaning.meaning import RowMeaning, ranked
from workbench.identification.meaning.reading import FITS, GOOD, NARROW, RowReading
from workbench.identification.meaning.search import CLEAR, FEW_POINTS, SURE, ReadingSearch
from workbench.identification.meaning.unexplained import explained
from workbench.identification.meaning.usable_rows import few_each, usable, without_still_turns

HELD_ROWS = 3
"""Minimum number of full poses of the flange."""
SISTER_OFF, SISTER_MOVED = 1e-3, 3e-3
"""Distance of rows, and change of a length [m], from which on another arm's table may be nearer."""


def read_rows(robot: Robot, data: Dataset, *, likely: bool = False) -> RowMeaning | None:
    """What rows mean for an arm; None with too few rows with a point.

    Args:
        robot: The arm that is said to have moved.
        data: Rows; those of the session, and of the point, that has most are looked at.
        likely: Whether only signs, couplings and zeros are tried, of an arm that is known to be this one.
    """
    data = without_still_turns(robot, data)
    if (meaning := _searched(robot, data, likely)) is None or data.missing_units:
        return meaning
    off, is_asked = meaning.best.position, meaning.best.is_plain and OTHER_ARMS.name not in meaning.tried
    rows = usable(data) if is_asked and off > SISTER_OFF else None
    if rows is not None and (rival := other_arm(robot, rows, off / CLEAR)) is not None:
        return RowMeaning(best=rival, plain=meaning.plain, tried=meaning.tried)
    return meaning if likely else explained(robot, data, meaning)


def _searched(robot: Robot, data: Dataset, likely: bool) -> RowMeaning | None:
    rows = usable(data)
    rows, sessions = few_each(data) if rows is None else (rows, 1)
    if not sessions:
        return None
    if data.joints == robot.dof:
        every, arm = ReadingSearch(robot, data=rows, count=len(rows)), robot.in_session(rows.sessions[0])
        known = every.plain(given=(arm.base.pose, arm.tool.pose))
        if every.suffices(known) and not known.apart:
            return RowMeaning(best=known, plain=known)
    search, plain, kind = ReadingSearch(robot, data=rows, sessions=sessions), None, Rows.COLUMNS
    if data.joints == robot.dof:
        if search.suffices(plain := search.plain()):
            return RowMeaning(best=plain, plain=plain)
        search.found = [plain, *search.place([RowReading.plain(robot)])]
        if search.suffices(search.found[1]) and not search.found[1].mirrored:  # signs may do the same
            return ranked(search, plain)
        near = min(r.position for r in search.found) < FITS * robot.reach  # meets exchanges and zeros first
        kind = Rows.KNOWN if likely else Rows.SESSIONS if sessions > 1 else Rows.NEAR if near else Rows.OWN
    families = [family for family in FAMILIES if kind in family.rows]
    for number, family in enumerate(families):
        is_last = family is families[-1]
        if plain is not None and number and family.is_asked and _is_done(search, plain, last=is_last):
            break
        search.family(family)
    if not search.found:
        return None
    search.twins()
    return ranked(search, plain)


def other_arm(robot: Robot, data: Dataset, limit: float) -> RowReading | None:
    """The built-in arm that fits points, as they are given, best and to less than a limit [m], if any."""
    search = ReadingSearch(robot, data=replace(data, rotation=None, written=None))
    search.family(OTHER_ARMS, most=2.0 * max(limit / robot.reach, search.bound))
    fits = (r for r in search.found if r.fits and r.motion < NARROW and r.position < limit)
    return min(fits, key=lambda r: r.score, default=None)


def read_any(robots: Sequence[Robot], data: Dataset, *, held: bool) -> RowMeaning:
    """What rows mean that are of one of several arms, which share a name; that of the best reading moved.
    If `held` they are a few full poses of the flange in its base; else base and tool are free."""
    search = ReadingSearch(*robots, data=data, held=held)
    if not held:
        search.found = [search.place([RowReading.plain(robot)])[0] for robot in robots]
    for family in FAMILIES:
        if Rows.HELD not in family.rows:
            continue
        search.family(family)
        best = min(search.found, key=lambda r: r.score)
        if best.score < search.sure:
            break
    if held:
        flips, middle = 1.0 - 2.0 * np.eye(len(best.w)), best.w @ best.in_units(search.data.q).mean(0)
        turned = ((s[:, None] * best.w, best.zero + (1.0 - s) * middle) for s in flips)
        back = [replace(best, w=w, zero=zero, convention=None) for w, zero in turned]
        search.found += search.place(search.refined(back))  # each joint the other way about its middle
    else:
        search.twins()
    return ranked(search, None)


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

"""How well a nominal arm fits rows as given, with the best base and tool."""

from dataclasses import replace

import numpy as np
from scipy import special

from workbench.arm.frame import FRAME_PARTS
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.arm.robot import Robot
from workbench.base.types import Freedom
from workbench.base.wording import in_mm, listed
from workbench.data.dataset import Dataset
from workbench.data.observations.places import PLANE, ContactObservation, DistanceObservation
from workbench.data.postures import within_postures
from workbench.data.readers.assemble import MAX_MARKERS
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import align
from workbench.identification.errors.expected_deviation import MAX_DEVIATION, USUAL_DEVIATION
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.meaning.families import SIGN
from workbench.identification.meaning.meaning import RowMeaning, ranked
from workbench.identification.meaning.reading import FITS, RowReading
from workbench.identification.meaning.search import ReadingSearch
from workbench.identification.meaning.usable_rows import MIN_ROWS, usable
from workbench.identification.problem import FrameFreedom, Problem
from workbench.identification.rows.outlying_rows import robust_fit

CHANCE, EXACT = 1e-4, 1e-9
"""Significance level at which draw wires have unknown zeros, and |r|² that is rounding."""
SURE_TORQUE = 0.8
"""Minimum correlation with the torque that holds a weight at the flange."""
CLEAR = 10.0
"""By how much planes must fit contacts better than points, and several points of the tool better than one."""


def placed(robot: Robot, data: Dataset) -> Robot:
    """The nominal arm with the base and tool that fit its rows best; unchanged with too few points."""
    if data.joints != robot.dof or (rows := usable(data)) is None:
        return robot
    at = ReadingSearch(robot, data=rows).plain()
    return replace(robot, mounting=robot.mounting.at(at.base, at.tool), sessions={})


def near_readings(robot: Robot, data: Dataset) -> RowMeaning | None:
    """What rows mean of: as given, one or two joints inverted, two coupled; None with too few points."""
    if data.joints != robot.dof or (rows := usable(data)) is None:
        return None
    search = ReadingSearch(robot, data=rows)
    signs = search.arms[0].every(*search.arms[0].couplings)
    near = [replace(RowReading.plain(robot), w=w) for w in signs.w[signs.cost <= 2.0 * SIGN]]
    search.found = [search.plain(), *search.place(near)]
    return ranked(search, None)


def with_planes(robot: Robot, data: Dataset) -> Dataset:
    """The rows, in which contacts that only planes explain are named so, with a note."""
    if data.contact is None or data.position is not None or data.joints != robot.dof:
        return data
    rows = np.flatnonzero(data.included & ContactObservation.applies(data))
    each = ((str(name), rows[data.contact[rows] == name]) for name in {*data.contact[rows]})
    off = {name: _misfit(robot, data.take(own)) for name, own in each}
    flat = sorted(name for name, size in off.items() if size > FITS * robot.reach)
    found = {name: f"{PLANE} {name}" for name in flat}
    as_planes = replace(data, contact=np.array([found.get(n, n) for n in data.contact.tolist()]))
    rows = rows[np.isin(data.contact[rows], flat)]
    if len(rows) < 6 * (len(flat) + 1):  # twice the unknowns
        return data
    far, near = min(off[name] for name in flat), _misfit(robot, as_planes.take(rows))
    if near > min(FITS * robot.reach, far / CLEAR):
        return data
    note = f"contacts {listed(flat)} are read as with planes: {in_mm(near)} off, of fixed points {in_mm(far)}"
    return replace(as_planes, notes=(*data.notes, note))


def with_wires(robot: Robot, data: Dataset) -> Dataset:
    """The rows with a draw wire of unknown zero at each anchor, where any arm leaves far more without."""
    rows = data.included & DistanceObservation.applies(data)
    is_told = data.position is not None or "draw_wire" in data.more
    if data.joints != robot.dof or data.anchor is None or is_told or not rows.any():
        return data
    wired = replace(data, more={**data.more, "draw_wire": data.anchor})
    frames = FrameFreedom((), FRAME_PARTS[:3] if robot.tool.free is not Freedom.FIXED else ())
    both = (Problem.build(robot, d.take(rows), frames=frames).with_shares() for d in (data, wired))
    few, many = (p.with_deviation(MAX_DEVIATION) for p in both)
    without, left = (max(2.0 * Opt2(limit=60).search(p).history[-1], EXACT) for p in (few, many))
    gained, spare = len(many.names) - len(few.names), many.count + len(many.prior) - len(many.names)
    chance = special.fdtrc(gained, max(spare, 1), max(without / left - 1.0, 0.0) * spare / gained)
    if chance > CHANCE or without < 3.0 * left:  # an arm's effects leave up to 2.6 times as much
        return data
    where = listed(sorted({*data.anchor[rows]}))
    note = f"draw wires at {where} have unknown zeros: any arm leaves {np.sqrt(without / left):.2g} "
    return replace(wired, notes=(*data.notes, f"{note}times as much without (decided from the data)"))


def with_tool_points(robot: Robot, data: Dataset) -> Dataset:
    """The rows with several points of the tool, as many as they have labels, where one leaves far more."""
    if data.point is None or data.position is None or data.rotation is not None or data.joints != robot.dof:
        return data
    rows = data.included & np.isfinite(data.position).all(1)
    names, counts = np.unique(data.point[rows], return_counts=True)
    if not 1 < len(names) <= MAX_MARKERS or "" in names or counts.min() < MIN_ROWS:
        return data
    own = (data.point[:, None] == names)[..., None]
    apart = replace(data, position=None, point=None, markers=np.where(own, data.position[:, None], np.nan))
    sizes, several = [], len(data.sessions) > 1
    for tried, tool in ((data, FRAME_PARTS[:3]), (apart, ())):
        freedom = FrameFreedom(FRAME_PARTS, tool, base_per_session=several)
        arm, some = align(robot, tried.take(rows), freedom), tried.take(rows)
        problem = Problem.build(arm, some, frames=freedom).with_shares().with_deviation(USUAL_DEVIATION)
        off = robust_fit(problem, Opt2(limit=60).search(problem).x)[1]
        sizes.append(float(np.median(off[:, 0])) * problem.noise.position)
    one, left = sizes
    if CLEAR * left > one:
        return data
    note = f"{listed(names.tolist())} are markers of one tool: {in_mm(left)} off, as one point {in_mm(one)}"
    return replace(apart, notes=(*data.notes, f"{note} (decided from the data)"))


def with_holding_torques(robot: Robot, data: Dataset) -> Dataset:
    """The rows with torques of the drives, with a note where the columns have the opposite sign.

    The weight at the flange is the payload, compared at the same postures, or else that of the links. An arm
    with masses needs no measured torques.
    """
    shown = data.torque
    if shown is None or robot.has_masses or shown.shape[1] != robot.dof or not np.isfinite(shown).all():
        return data
    torque = shown
    expected = -np.einsum("rij,i->rj", geometric_jacobian(robot.bare, data.q)[:, :3], robot.gravity)
    if data.payload is not None and np.isfinite(data.payload).all():
        change = within_postures(data.q, data.payload[:, None])
        if change.any():
            expected, torque = change * expected, within_postures(data.q, torque)
    size = np.linalg.norm(expected) * np.linalg.norm(torque)
    if not size or (expected * torque).sum() > -SURE_TORQUE * size:
        return data
    note = "torque1 … have the sign of the load; read as the torques of the drives, which hold it"
    return replace(data, torque=-shown, notes=(*data.notes, note))


def _misfit(robot: Robot, touches: Dataset) -> float:
    """Root mean square distance [m] of touches from the places that they name, with the best tool point."""
    aligned = align(robot.bare, touches, FrameFreedom((), FRAME_PARTS[:3]))
    return float(np.sqrt((row_errors(aligned, touches).position ** 2).mean()))

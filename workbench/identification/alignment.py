"""Initial alignment of base and tool, before anything else is known: closed forms, then a short fit.

With full poses B_i = X A_i Z (A the arm's nominal pose, X the base, Z the tool) both come from `hand_eye`.
With points alone the base (Arun's rigid fit) and the tool point (linear) are found alternately.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.hand_eye import hand_eye, mean_base
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import FrameFreedom, Noise, Problem

MAX_ALTERNATIONS, MAX_STEPS = 20, 100
"""Alternations between base and tool for points, each a closed form; and steps of a search."""
MAX_ALIGNED_ROWS = 500
"""Maximum number of rows for the closed forms; all rows take part in the final fit."""
MAX_FIRST_ROWS = 1_500
"""Maximum number of rows of a first fit where there are many more."""
MIN_CERTAIN_ROWS, UNEXPLAINED = 10, 0.02
"""Rows, and share of the scatter of their points left, at which one start is enough: no other base and tool
explain so many points so well."""


def align(
    robot: Robot,
    data: Dataset,
    freedom: FrameFreedom,
    *,
    noise: Noise | None = None,
    known: Mapping[str, float] | None = None,
) -> Robot:
    """The nominal arm with the base and tool that fit the rows best, per session where they are free so.

    Args:
        noise: Weighs positions against rotations.
        known: Known places of anchors or contacts [m].
    """
    if not freedom.base and not freedom.tool:
        return robot
    begins = starts(robot, data, freedom)
    if len(data) > 2 * MAX_ALIGNED_ROWS:
        some = data.take(spread_rows(data, MAX_ALIGNED_ROWS))
        if some.sessions == data.sessions:
            begins = iter([align(robot, some, freedom, noise=noise, known=known)])
    best, minimum, points = robot, np.inf, data.position
    if points is not None and (len(points) < MIN_CERTAIN_ROWS or not np.isfinite(points).all()):
        points = None
    for start in begins:
        problem = Problem.build(start, data, free=(), frames=freedom, noise=noise, known=known)
        search = Opt2(limit=MAX_STEPS).search(problem)
        if search.history[-1] < minimum:
            best, minimum = problem.robot_at(search.x), search.history[-1]
        off = problem.physical(problem.residual(search.x))[problem.channels[0]]
        if points is not None and (off**2).sum() < UNEXPLAINED**2 * ((points - points.mean(0)) ** 2).sum():
            break  # it explains where the points lie: no other start finds another one
    sessions = {n: replace(m, gravity=robot.in_session(n).gravity) for n, m in best.sessions.items()}
    return replace(best.under(robot.gravity), sessions=sessions)  # only frames were to be fitted


def thinned(problem: Problem) -> Problem:
    """The problem on some of its rows where there are many; itself where these lack some of its unknowns."""
    rows = spread_rows(problem.data, MAX_FIRST_ROWS)
    if 2 * len(rows) > len(problem.data):
        return problem
    some = problem.again(data=problem.data.take(rows))
    if some.names != problem.names:
        return problem
    shares = None if problem.shares is None else problem.shares[rows]
    known = {name: getattr(problem, name) for name in ("knowledge", "prior_centre", "deviation")}
    return replace(some, shares=shares, **known)


def spread_rows(data: Dataset, count: int) -> np.ndarray:
    """At most so many row numbers, spread evenly over the data."""
    if len(data) <= count:
        return np.arange(len(data))
    return np.unique(np.linspace(0, len(data) - 1, count).astype(int))


def starts(robot: Robot, data: Dataset, freedom: FrameFreedom) -> Iterator[Robot]:
    """Starting points: the robot as given, then with base and tool from the closed forms."""
    yield robot
    points, is_free = data.position, bool(freedom.tool)
    if points is None and data.markers is not None:  # the one that is seen most is a point of the tool
        points, is_free = data.markers[:, np.isfinite(data.markers).all(2).sum(0).argmax()], True
    if not freedom.base or points is None:
        return
    arm = chains.poses(robot.bare.chain, data.q)
    seen = np.isfinite(points).all(-1)
    groups = [np.flatnonzero(seen & data.in_session(name)) for name in data.sessions]
    groups = groups if freedom.base_per_session else [np.concatenate(groups)]
    if not all(map(len, groups)):
        return
    rotations = data.rotation
    if rotations is not None and np.isfinite(rotations[seen]).all():
        largest = max(groups, key=len)
        tool = robot.tool.pose
        if freedom.tool and len(largest) >= 3:
            tool = hand_eye(arm[largest], se3.pose(rotations[largest], points[largest]))
        bases = [mean_base(arm[g] @ tool, se3.pose(rotations[g], points[g])) for g in groups]
    else:
        point = _tool_point(robot, points, arm, groups) if is_free else robot.tool.xyz
        bases = [se3.best_fit(se3.apply(arm[g], point[None]), points[g]) for g in groups]
        tool = se3.pose(robot.tool.rotation, point)
    placed, sessions = tool if freedom.tool else robot.tool.pose, robot.sessions
    if freedom.base_per_session:
        pairs = zip(data.sessions, bases, strict=True)
        sessions = {name: robot.in_session(name).mounting.at(base, placed) for name, base in pairs}
    yield replace(robot, mounting=robot.mounting.at(bases[0], placed), sessions=sessions)


def _tool_point(robot, points, arm, groups) -> Float[np.ndarray, "3"]:
    """Initial guess of the tool point from points alone."""
    point = np.array(robot.tool.xyz)
    for _ in range(MAX_ALTERNATIONS):
        rows, right = [], []
        for g in groups:
            base = se3.best_fit(se3.apply(arm[g], point[None]), points[g])
            rows.append((base[:3, :3] @ arm[g, :3, :3]).reshape(-1, 3))
            right.append((points[g] - se3.apply(base, arm[g, :3, 3])).ravel())
        point = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=1e-6)[0]
    return point

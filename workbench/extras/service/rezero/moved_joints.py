"""Joint zeros after a knock or with a new motor: which moved, by how much, what is ambiguous.

The last calibration is prior knowledge: every constant of the geometry is an unknown that is known to its
standard deviation, every joint's zero one of which nothing is known any more. Few poses then determine the
zeros, and their intervals hold what the geometry leaves open. Joints that moved by no more than chance are
then held to the calibration again, which makes the others more certain.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.arm.confounded_constants import combinations
from workbench.arm.parameters import FRAMES
from workbench.arm.robot import Robot
from workbench.base.arguments import Like, checked_arguments
from workbench.base.errors import DataError, WorkbenchError
from workbench.base.progress import part_of, progress, whole_or_nothing
from workbench.base.threads import one_thread
from workbench.base.types import Freedom
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.data.dataset import Dataset
from workbench.extras.service.rezero.last_calibration import NOMINAL, UNKNOWN, LastCalibration
from workbench.extras.service.rezero.optimum import Optimum
from workbench.extras.service.rezero.other_explanations import doubts
from workbench.extras.service.rezero.result import JointShift, Rezero, readable
from workbench.identification import noise as noises
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import align
from workbench.identification.errors.row_errors import Errors, instrument_places
from workbench.identification.fit_choices import Excluded, FitChoices, NoiseLike, Sessions
from workbench.identification.frames import visible_parts
from workbench.identification.meaning.as_read import is_misread, misread_text, oriented, with_own_columns
from workbench.identification.meaning.read_rows import read_rows
from workbench.identification.preparation import Prepared, prepare
from workbench.identification.problem import FrameFreedom, Problem
from workbench.identification.result import BeforeAfter
from workbench.identification.rows.row_selection import check_enough

SIGNIFICANT = 0.3
"""A zero known to less than this part of what it was before the rows counts as determined."""
TELLING = 5e-3
"""Half an interval about no shift at most, of a zero that did not move [rad or m]."""
CHANCE = 0.01
"""Probability that some joint is reported to have moved though none has."""
MAX_OFF = 0.02
"""Part of the reach within which rows must lie for zeros to be sought before the frames, or believed."""
STILL_OFF = 3.0
"""Times the calibration's error, or a known one of the instrument if larger, that rows may be off."""
FARTHEST = np.deg2rad(120.0)
"""A zero that moved farther is that of another arm, or of a search that went astray."""


@checked_arguments()
@one_thread()
@whole_or_nothing()
def rezero(
    robot: RobotLike,
    data: DatasetLike,
    *,
    noise: Like[NoiseLike] | None = None,
    frames: Sessions | str = Sessions.AUTO,
    exclude: Excluded | None = None,
) -> Rezero:
    """Find which joint's zero moved since the last calibration, from few poses.

    Args:
        robot: The calibrated arm, whose file records how well its constants are known; its base and tool say
            whether they are known, free, or the data decide.
        data: Three poses or more, by any instrument; or touches of seats, joints alone (`contact`).
        noise: Standard deviations of the instrument [m], [rad]; from repeats or the fit if None.
        frames: Whether sessions share base and tool.
        exclude: Rows to keep out, with the reason.

    Raises:
        Cancelled: asked to stop.
        DataError: too few rows, or data that contradict the robot beyond doubt.
    """
    zeros = robot.joint_offsets
    progress(0.0, "fitting the zeros")
    check_enough(robot, data.take(data.included), zeros)
    data = _counted(robot, data)
    begin = _near(robot, data)
    knowledge = LastCalibration.of(robot, begin)
    decides = data.readings is not None  # it lets zeros alone through; knowledge comes afterwards
    free = zeros if decides else knowledge.names
    choices = FitChoices(held_out=0.0, frames=frames, free=free, exclude=exclude or {}, noise=noise)
    with part_of(0.1, 0.3):
        ready = prepare(begin, data, choices, prior=None if decides else knowledge.without(*zeros))
    progress(0.4, "fitting all zeros")
    measured = noise is not None or noises.from_repeats(ready.problem.data) is not None
    problem = knowledge.problem(ready.problem, ready.problem.start, zeros) if decides else ready.problem
    everything = Optimum.of(problem, None if measured else knowledge.least_noise)
    moved, best = _moved(knowledge, everything, zeros)
    own = {s.name: s for s in _shifts(knowledge, best, moved)}
    shifts = tuple(own.get(s.name, s) for s in _shifts(knowledge, everything, zeros))
    shifts = tuple(replace(s, moved=s.name in moved and abs(s.shift) > s.half) for s in shifts)
    found, shifts = _written(knowledge, best, shifts)
    error = BeforeAfter(_errors(ready, best, _aligned(best, robot)), _errors(ready, best, found))
    still = _still_off(robot, best, error.after, _errors(ready, best, best.problem.robot_at(best.x)))
    reasons = ready.identifiability.doubts
    with part_of(0.6, 0.3):
        reasons = (
            reasons or _astray(shifts, ready, everything) or doubts(knowledge, everything, far=bool(still))
        )
    if not reasons and (lost := [s for s in shifts if s.moved and not s.determined]):
        reasons = (
            f"joint {lost[0].joint + 1} fits the rows best, but they are still "
            f"{error.after.position_mm.mean:.2g} mm off and don't determine its zero; check that they are of "
            "this arm, or recalibrate it",
        )
    progress(0.9, "what can't be distinguished")
    if robot.calibration is not None and robot.calibration.error is not None:
        reasons = reasons or still
    return Rezero(
        calibrated=robot,
        robot=robot if reasons else found,
        shifts=shifts,
        doubts=reasons,
        ambiguous=_ambiguous(knowledge, ready, shifts),
        error=error,
        noise=best.problem.noise,
        data=ready.problem.data,
        excluded=ready.excluded,
        notes=(*ready.notes, *_uncalibrated(robot), *(() if reasons else still)),
    )


def _uncalibrated(robot: Robot) -> tuple[str, ...]:
    """What an arm without a record counts as known to."""
    if robot.calibration is not None:
        return ()
    known = f"{1e3 * NOMINAL:g} mm and {np.rad2deg(NOMINAL):.2g}°"
    return (
        f"the file of '{robot.name}' has no calibration record, so its lengths and angles are assumed known "
        f"to {known} (1 σ); give the file that identify saved as the robot",
    )


def _still_off(robot: Robot, fit: Optimum, after: Errors, left: Errors) -> tuple[str, ...]:
    """A sentence on rows that are far less accurate with the zeros found than the calibration was.

    Where nobody knows how accurate it was: than `left` with all that may have changed, few rows to spare.
    """
    own = None if robot.calibration is None else robot.calibration.error
    few, noise = fit.problem.count / fit.spare, np.sqrt(3.0) * fit.measured * np.array(fit.problem.noise[:2])
    pairs = (after.position_mm, left.position_mm), (after.orientation_deg, left.orientation_deg)
    for k, ((errors, rest), (scale, unit)) in enumerate(zip(pairs, map(readable, ("m", "rad")), strict=True)):
        if errors is None or rest is None:
            continue
        known, than = few * rest.mean, "other lengths and angles leave"
        if own is not None:
            known, than = scale * own[k], "the calibration's were"
        if errors.mean > STILL_OFF * max(known, scale * noise[k]):
            return (
                f"with these zeros the rows are still {errors.mean:.2g}{unit} off, {than} {known:.2g}{unit}; "
                "measure more, give --noise if the instrument scatters so, or 'workbench identify' again",
            )
    return ()


def _astray(shifts: tuple[JointShift, ...], ready: Prepared, fit: Optimum) -> tuple[str, ...]:
    """A sentence on zeros that no joint can have moved by, or that leave the rows far off."""
    robot = fit.problem.robot_at(fit.x)
    off = _errors(ready, fit, robot).position_mm.rms
    far = max(shifts, key=lambda s: abs(s.shift) * (s.unit == "rad"))
    if far.unit == "rad" and abs(far.shift) > FARTHEST:
        text = f"the search diverged, joint {far.joint + 1} to {np.rad2deg(far.shift):+.0f}°"
    elif off > 1e3 * MAX_OFF * robot.reach:
        text = f"no zeros explain the rows, which are still {off:.0f} mm off"
    else:
        return ()
    check = (
        "check the joints (units, signs, order of the rows), the robot, and where the instrument is mounted"
    )
    return (f"{text}; {check}",)


def _counted(robot: Robot, data: Dataset) -> Dataset:
    """The rows in the convention that is theirs; refused if their joints count otherwise than the arm's, but
    for the zero of one, as of a new motor."""
    data = with_own_columns(robot, data)
    robot.check_joints(data.said.q, data.source)
    found = None if data.readings is not None else read_rows(robot, data, likely=True)
    is_zero = found is not None and found.best.only_zeros and np.count_nonzero(found.best.zero) == 1
    if found is not None and is_misread(found) and not is_zero:
        text = misread_text(found, robot)
        raise DataError(f"{data.source}: {text}; no collision does that: correct the rows")
    return data if found is None else oriented(data, found)


def _near(robot: Robot, data: Dataset) -> Robot:
    """The arm with zeros that fit the rows on base and tool as they are in its file, if any do.

    A joint that is far off would else be taken for a base that stands elsewhere. Frames are as given where
    zeros alone explain rows that can't tell both frames beside them.
    """
    robot.check_joints(data.q, data.source)
    if data.readings is not None:  # they may show no base
        return robot
    try:
        problem = Problem.build(robot, data.take(data.included), free=robot.joint_offsets)
    except WorkbenchError:  # reported where the rows are checked
        return robot
    search = Opt2(limit=60).search(problem)
    off = problem.physical(problem.residual(search.x))[problem.component_channels == 0]
    off = np.sqrt(3.0 * (off**2).mean()) if len(off) else 0.0
    unknown = len(robot.joint_offsets) + sum(map(len, visible_parts(problem.data, problem.known)))
    known = NOMINAL if robot.calibration is None else (robot.calibration.error or [NOMINAL])[0]
    if problem.count <= unknown and off < STILL_OFF * known:
        frames = {"base": robot.base, "tool": robot.tool}
        given = {k: replace(f, free=Freedom.FIXED) for k, f in frames.items() if f.free is Freedom.AUTO}
        robot = robot.with_frames(**given)
        problem = problem.again(robot=robot)
    near = off < MAX_OFF * robot.reach and np.isfinite(search.x).all()
    return problem.robot_at(search.x) if near else robot


def _shifts(knowledge: LastCalibration, fit: Optimum, loose: Sequence[str]) -> tuple[JointShift, ...]:
    """How far each zero that was let go is from where the calibration had it, which knew it only so well
    itself."""
    robot, chain, wide = knowledge.robot, knowledge.robot.chain, fit.quantile(0.95)
    sizes = zip(loose, *knowledge.shifts(loose, fit.values, fit.factor.covariance()), strict=True)
    return tuple(
        JointShift(
            joint=robot.joint_offsets.index(name),
            name=name,
            unit=chain.elements[chain.index[name]].unit,
            shift=float(shift),
            std=float(std),
            half=float(wide * std),
            determined=bool(std < SIGNIFICANT * UNKNOWN and wide * std < max(TELLING, abs(shift))),
        )
        for name, shift, std in sizes
    )


def _moved(
    knowledge: LastCalibration, everything: Optimum, zeros: tuple[str, ...]
) -> tuple[tuple[str, ...], Optimum]:
    """Zeros that moved by more than chance, and the fit in which the others are held to the calibration.

    Where the rows show that something else moved but not which joint, it is the one that explains them best.
    """

    def with_free(*names: str) -> Optimum:
        progress(0.5, "which joints moved")
        own = knowledge.problem(everything.problem, everything.x, names)
        return Optimum.of(own, everything.least)

    limit = everything.quantile(1.0 - CHANCE / len(zeros))
    known = (s for s in _shifts(knowledge, everything, zeros) if s.determined)
    moved = [s.name for s in known if abs(s.shift) > limit * s.std]
    while True:
        held, others = with_free(*moved), [n for n in zeros if n not in moved]
        if not others or everything.against(held, len(others))[0] > CHANCE:
            return tuple(moved), held
        moved.append(min(others, key=lambda name: with_free(*moved, name).square))


def _written(
    knowledge: LastCalibration, fit: Optimum, shifts: tuple[JointShift, ...]
) -> tuple[Robot, tuple[JointShift, ...]]:
    """The calibrated arm with the zeros that moved where they suit the rows best, and how far they moved so.

    The arm keeps its lengths and angles, which are accurate together where the calibration recorded their
    covariance: zeros that go with others would then leave the rows farther off.
    """
    robot, moved = knowledge.robot, {s.name: s.shift for s in shifts if s.moved}
    kept = {n: knowledge.value(n) + moved.get(n, 0.0) for n in knowledge.names}
    found = _aligned(fit, fit.problem.robot_at(fit.x).with_values(kept))
    found = found.with_frames(
        base=replace(found.base, free=robot.base.free), tool=replace(found.tool, free=robot.tool.free)
    )
    if not moved or robot.calibration is None or not robot.calibration.covariance.size:
        return found, shifts
    problem = fit.problem.again(robot=found, free=tuple(moved))
    found = problem.robot_at(Opt2(limit=60).search(problem).x)
    off = dict(zip(moved, found.values(tuple(moved)) - robot.values(tuple(moved)), strict=True))
    now = tuple(replace(s, shift=float(off.get(s.name, s.shift))) for s in shifts)
    now = tuple(replace(s, moved=s.moved and abs(s.shift) > s.half) for s in now)
    return (found, now) if all(s.moved for s in now if s.name in moved) else _written(knowledge, fit, now)


def _aligned(fit: Optimum, robot: Robot) -> Robot:
    """An arm on the base and with the tool that suit the rows best, wherever these are free."""
    problem = fit.problem
    return align(robot, problem.data, problem.frames, noise=problem.noise, known=problem.known)


def _errors(ready: Prepared, fit: Optimum, robot: Robot) -> Errors:
    rows, known = fit.problem.data, fit.problem.known
    return ready.errors_on(rows, robot, instrument_places(robot, rows, known=known))


def _ambiguous(
    knowledge: LastCalibration, ready: Prepared, shifts: tuple[JointShift, ...]
) -> tuple[str, ...]:
    """Sentences on zeros that a base or tool elsewhere, or other zeros, would show alike."""
    taken, by_name = ready.problem.frames, {s.name: s for s in shifts}
    freedom = FrameFreedom(*visible_parts(ready.problem.data, ready.problem.known))
    problem = ready.problem.again(robot=ready.aligned, free=knowledge.names, frames=freedom)
    problem = knowledge.without().keep(lambda name: name not in by_name).on(problem)
    factor = noises.factor_at(problem, problem.start)
    size = np.array([10.0 if p.unit == "m" else 1.0 for p in problem.parameters])  # 0.1 m is as much as 1 rad
    unseen = size[:, None] * np.concatenate([factor.null_space, factor.weak], axis=1)
    readings = ready.data.readings
    own = set(FRAMES if readings is None else (*FRAMES, *readings.frames))
    sentences = []
    for combination in combinations(unseen, problem.parameters):
        shifted = [by_name[n] for n in combination.names if n in by_name]
        if not any(s.moved or not s.determined for s in shifted):
            continue
        frames = sorted({re.split(r"[.\[]", n)[0] for n in combination.names} & own)
        joints = " and ".join(f"joint {s.joint + 1}" for s in shifted)
        if not frames:
            sentences.append(f"the zeros of {joints} ({combination.text}): measure poses that differ more")
            continue
        frame = " and ".join(frames)
        to = frame if any(getattr(taken, f, True) for f in frames) else "joint"
        why = f"it was assigned to the {to}"
        why += f"; if that is wrong, change free of [{frames[0]}]" if set(frames) <= set(FRAMES) else ""
        sentences.append(f"the zero of {joints} and a turn of the {frame} ({combination.text}): {why}")
    return tuple(sentences)

"""Joint zeros after a knock or with a new motor: which moved, by how much, what is ambiguous.

The last calibration is prior knowledge: every constant of the geometry is an unknown that is known to its
standard deviation, every joint's zero one of which nothing is known any more. Few poses then determine the
zeros, and their intervals hold what the geometry leaves open. Joints that moved by no more than chance are
then held to the calibration again, which makes the others more certain.
"""

import re
from collections.abc import Iterator, Sequence
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
from workbench.extras.service.rezero.result import UNDETERMINED, JointShift, Rezero, readable
from workbench.identification import noise as noises
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.errors.expected_deviation import USUAL_DEVIATION
from workbench.identification.errors.row_errors import Errors, row_errors
from workbench.identification.fit_choices import Excluded, FitChoices, NoiseLike, Sessions
from workbench.identification.frames import visible_parts
from workbench.identification.meaning.as_read import as_told, with_own_columns, with_units
from workbench.identification.meaning.read_rows import read_rows
from workbench.identification.preparation import Prepared, prepare
from workbench.identification.problem import FrameFreedom, Problem
from workbench.identification.result import BeforeAfter
from workbench.identification.rows.row_selection import check_enough

SIGNIFICANT, TELLING = 0.3, 5e-3
"""A zero known to less than this part of what it was before the rows counts as determined; half an interval
about no shift at most, of one that did not move [rad or m]."""
CHANCE = 0.01
"""Probability that some joint is reported to have moved though none has."""
MAX_OFF, STILL_OFF = 0.02, 3.0
"""Part of the reach within which rows must lie for zeros to be sought before the frames, or believed; times
the calibration's error, or a known one of the instrument if larger, that they may be off."""
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
    exclude: Like[Excluded] | None = None,
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
    knowledge = _near(LastCalibration.of(robot), data)
    decides = data.readings is not None  # it lets zeros alone through; knowledge comes afterwards
    names, known = knowledge.known.names, knowledge.without(*zeros)
    free = zeros if decides else names
    choices = FitChoices(held_out=0.0, frames=frames, free=free, exclude=exclude or {}, noise=noise)
    with part_of(0.1, 0.3):
        ready = prepare(knowledge.begin, data, choices, prior=None if decides else known)
    progress(0.4, "fitting all zeros")
    measured = noise is not None or noises.from_repeats(ready.problem.data) is not None
    problem = known.on(ready.problem.again(free=names)) if decides else ready.problem
    everything = Optimum.of(problem, None if measured else knowledge.least_noise)
    notes, wide, freest = [*ready.notes], knowledge, everything
    if robot.calibration is None:
        std = max(NOMINAL * everything.misjudged, USUAL_DEVIATION)
        wide = replace(knowledge, known=LastCalibration.of(robot, std).known)
        freest = everything.freed(wide, zeros)
        assumed = f"assumed known to {1e3 * std:.2g} mm and {np.rad2deg(std):.2g}° (1 σ)"
        what = f"the file of '{robot.name}' has no calibration record: its lengths and angles are {assumed}"
        notes.append(f"{what}; give the file that identify saved as the robot")
    shifts, best = _moved(wide, freest, zeros)
    found, shifts = _written(knowledge, best, shifts)
    error = BeforeAfter(best.errors(best.aligned(robot)), best.errors(found))
    still = _still_off(knowledge, best, error.after)
    reasons = ready.identifiability.doubts or _astray(shifts, everything)
    with part_of(0.6, 0.3):
        reasons = reasons or doubts(knowledge, everything, far=bool(still))
    if not reasons and (lost := [s for s in shifts if s.moved and not s.determined]):
        reasons = (
            f"joint {lost[0].joint + 1} fits the rows best, but they are still "
            f"{error.after.position_mm.mean:.2g} mm off and don't determine its zero; check that they are of "
            "this arm, or recalibrate it",
        )
    is_unlike_nominal = not any(s.moved for s in shifts) and error.after.expected[0] > 2.0 * NOMINAL
    if knowledge.error is not None or is_unlike_nominal:
        reasons = reasons or still
    if not any(s.determined for s in shifts):
        reasons = reasons or (UNDETERMINED,)
    progress(0.9, "what can't be distinguished")
    return Rezero(
        calibrated=robot,
        robot=robot if reasons else found,
        shifts=shifts,
        doubts=reasons,
        ambiguous=tuple(_ambiguous(knowledge, ready, shifts)),
        error=error,
        noise=best.problem.noise,
        data=ready.problem.data,
        excluded=ready.excluded,
        notes=(*notes, *(() if reasons else still)),
    )


def _still_off(knowledge: LastCalibration, fit: Optimum, after: Errors) -> tuple[str, ...]:
    """A sentence on rows that are far less accurate with the zeros found than the calibration was.

    Where nobody knows how accurate it was: than with all that may have changed, few rows to spare.
    """
    known, than = knowledge.error, "the calibration's were"
    if known is None:
        left = np.array(fit.errors(fit.problem.robot_at(fit.x)).expected)
        known, than = left * fit.problem.count / fit.spare, "other lengths and angles leave"
    noise = np.sqrt(3.0) * np.array(fit.problem.noise[:2]) * (fit.least is None)
    off = np.array(after.expected)
    for k in np.flatnonzero(off > STILL_OFF * np.maximum(known, noise)):
        scale, unit = readable(("m", "rad")[k])
        return (
            f"with these zeros the rows are still {scale * off[k]:.2g}{unit} off, {than} "
            f"{scale * known[k]:.2g}{unit}; measure more, give --noise if the instrument scatters so, or "
            "'workbench identify' again",
        )
    return ()


def _astray(shifts: tuple[JointShift, ...], fit: Optimum) -> tuple[str, ...]:
    """A sentence on zeros that no joint can have moved by, or that leave the rows far off."""
    robot = fit.problem.robot_at(fit.x)
    off = fit.errors(robot).position_mm.rms
    far = max(shifts, key=lambda s: abs(s.shift) * (s.unit == "rad"))
    if far.unit == "rad" and abs(far.shift) > FARTHEST:
        text = f"the search diverged, joint {far.joint + 1} to {np.rad2deg(far.shift):+.0f}°"
    elif off > 1e3 * MAX_OFF * robot.reach:
        text = f"no zeros explain the rows, which are still {off:.0f} mm off"
    else:
        return ()
    checked = "the joints (units, signs, order of the rows), the robot, and where the instrument is mounted"
    return (f"{text}; check {checked}",)


def _counted(robot: Robot, data: Dataset) -> Dataset:
    """The rows in the convention that is theirs; refused if their joints count otherwise than the arm's, but
    for the zero of one, as of a new motor."""
    data = with_own_columns(robot, with_units(robot, data) if data.missing_units else data)
    robot.check_joints(data.said.q, data.source)
    found = None if data.readings is not None else read_rows(robot, data, likely=True)
    if found is None:
        return data
    is_zero = found.best.only_zeros and np.count_nonzero(found.best.zero) == 1
    if found.is_misread and not is_zero:
        text = found.text(bare=bool(robot.effects))
        raise DataError(f"{data.source}: {text}; no collision does that: choose the robot or correct rows")
    return as_told(data, found)


def _near(knowledge: LastCalibration, data: Dataset) -> LastCalibration:
    """The knowledge, beginning at zeros that fit the rows on base and tool as in the file, if any do.

    A joint that is far off would else be taken for a base that stands elsewhere. Frames are as given where
    zeros alone explain rows that can't tell both frames beside them.
    """
    robot, known = knowledge.robot, NOMINAL if knowledge.error is None else knowledge.error[0]
    if data.readings is not None:  # they may show no base
        return knowledge
    try:
        problem = Problem.build(robot, data.take(data.included), free=robot.joint_offsets)
    except WorkbenchError:  # reported where the rows are checked
        return knowledge
    if not np.isfinite(x := Opt2(limit=60).search(problem).x).all():
        return knowledge
    off = np.nan_to_num(1e-3 * row_errors(begin := problem.robot_at(x), problem.data).position_mm.rms)
    if off > MAX_OFF * robot.reach:
        return knowledge
    unknown = len(robot.joint_offsets) + sum(map(len, visible_parts(problem.data, problem.known)))
    if problem.count <= unknown and off < STILL_OFF * known:
        open_ = {k: f for k in ("base", "tool") if (f := getattr(robot, k)).free is Freedom.AUTO}
        begin = begin.with_frames(**{k: replace(f, free=Freedom.FIXED) for k, f in open_.items()})
    return replace(knowledge, begin=begin)


def _shifts(knowledge: LastCalibration, fit: Optimum, loose: Sequence[str]) -> tuple[JointShift, ...]:
    """How far each zero that was let go is from where the calibration had it, which knew it only so well
    itself."""
    robot, chain, wide = knowledge.robot, knowledge.robot.chain, fit.quantile(0.95)
    values, covariance = fit.problem.named(fit.x), fit.factor.covariance()
    sizes = zip(loose, *knowledge.shifts(loose, values, covariance), strict=True)
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
) -> tuple[tuple[JointShift, ...], Optimum]:
    """How far all zeros are off, those that moved by more than chance marked; and the fit in which the others
    are held to the calibration.

    Where the rows show that something else moved but not which joint, it is the one that explains them best.
    """
    limit = everything.quantile(1.0 - CHANCE / len(zeros))
    shifts = {s.name: s for s in _shifts(knowledge, everything, zeros)}
    moved = [n for n, s in shifts.items() if s.determined and abs(s.shift) > limit * s.std]
    while True:
        progress(0.5, "which joints moved")
        held, others = everything.freed(knowledge, moved), [n for n in zeros if n not in moved]
        if not others or everything.against(held)[0] > CHANCE:
            own = {s.name: replace(s, moved=True) for s in _shifts(knowledge, held, moved)}
            return (*(shifts | own).values(),), held
        moved.append(min(others, key=lambda name: everything.freed(knowledge, (*moved, name)).square))


def _written(
    knowledge: LastCalibration, fit: Optimum, shifts: tuple[JointShift, ...]
) -> tuple[Robot, tuple[JointShift, ...]]:
    """The calibrated arm with the zeros that moved where they suit the rows best, and how far they moved so.

    The arm keeps its lengths and angles, which are accurate together where the calibration recorded their
    covariance: zeros that go with others would then leave the rows farther off.
    """
    robot = knowledge.robot
    shifts = tuple(replace(s, moved=s.moved and abs(s.shift) > s.half) for s in shifts)
    moved = tuple(s.name for s in shifts if s.moved)
    before, off = robot.values(moved), [s.shift for s in shifts if s.moved]
    found = fit.aligned(robot.with_values(dict(zip(moved, np.add(before, off), strict=True))))
    if not moved or robot.calibration is None or not robot.calibration.covariance.size:
        return found, shifts
    problem = fit.problem.again(robot=found, free=moved)
    found = problem.robot_at(Opt2(limit=60).search(problem).x)
    now = dict(zip(moved, (found.values(moved) - before).tolist(), strict=True))
    shifts = tuple(replace(s, shift=now.get(s.name, s.shift)) for s in shifts)
    is_less = any(s.moved and abs(s.shift) <= s.half for s in shifts)
    return _written(knowledge, fit, shifts) if is_less else (found, shifts)


def _ambiguous(knowledge: LastCalibration, ready: Prepared, shifts: tuple[JointShift, ...]) -> Iterator[str]:
    """Sentences on zeros that a base or tool elsewhere, or other zeros, would show alike."""
    taken, by_name = ready.problem.frames, {s.name: s for s in shifts}
    freedom = FrameFreedom(*visible_parts(ready.problem.data, ready.problem.known))
    problem = ready.problem.again(robot=ready.aligned, free=knowledge.known.names, frames=freedom)
    problem = knowledge.without().keep(lambda name: name not in by_name).on(problem)
    factor = noises.factor_at(problem, problem.start)
    size = np.array([10.0 if p.unit == "m" else 1.0 for p in problem.parameters])  # 0.1 m is as much as 1 rad
    unseen = size[:, None] * np.concatenate([factor.null_space, factor.weak], axis=1)
    readings = ready.data.readings
    own = set(FRAMES if readings is None else (*FRAMES, *readings.frames))
    for combination in combinations(unseen, problem.parameters):
        shifted = [by_name[n] for n in combination.names if n in by_name]
        if not any(s.moved or not s.determined for s in shifted):
            continue
        frames = sorted({re.split(r"[.\[]", n)[0] for n in combination.names} & own)
        joints = " and ".join(f"joint {s.joint + 1}" for s in shifted)
        if not frames:
            yield f"the zeros of {joints} ({combination.text}): measure poses that differ more"
            continue
        frame = " and ".join(frames)
        why = frame if any(getattr(taken, f, True) for f in frames) else "joint"
        why += f"; if that is wrong, change free of [{frames[0]}]" if set(frames) <= set(FRAMES) else ""
        alike = f"the zero of {joints} and a turn of the {frame} ({combination.text})"
        told = f"it was assigned to the {why}" if any(s.moved for s in shifted) else "the rows tell neither"
        yield f"{alike}: {told}"

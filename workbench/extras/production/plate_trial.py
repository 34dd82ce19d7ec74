"""A plate tried on virtual arms: how many of a production run meet the requirement, and what is to blame.

    made        every free constant off evenly within ±1 mm, ±0.3°, or what is given
    measured    the joints of the actual arm at the actual targets, next to the planned ones
    calibrated  by OLS like measured rows, the plate taken as true; a prior like that of `identify`,
                σ = bound/√3, keeps near nominal what the targets leave open
    judged      at poses of the region that took no part

Source: ARIA §4.1.2 (second way of acquisition), eqs. (19)–(21), §2.4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.follow import follow_many
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.arguments import Angle, Count, LengthAndAngle, Like, Seed, Sigma, checked_arguments
from workbench.base.errors import DataError
from workbench.base.parallel import spread
from workbench.base.progress import part_of, running
from workbench.base.threads import one_thread
from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Requirement, Wanted
from workbench.data.arguments import RobotLike, WantedLike
from workbench.data.dataset import Dataset
from workbench.data.simulation.simulate import LIKELY_ERRORS, virtual_arm
from workbench.identification.algorithms.ols import Ols
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import Noise
from workbench.plate.arguments import PlateLike
from workbench.plate.plate import Kind, Plate
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.score import score
from workbench.plate.target_readings import assumptions, sigma_of, usual_kind
from workbench.report.blocks import Block, Sentence
from workbench.report.json import Json, document
from workbench.report.result_display import AbstractShown

JUDGED = 48
"""Poses of the region at which each arm is judged."""
JOINTS = "joint readings"
EXACT, UNSEEN = 1e-9, 1e3
"""Standard deviations by which exact readings, and angles that are not read, are weighted [m or rad]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Trial:
    """Where virtual arms are calibrated and judged, and what goes wrong.

    Args:
        robot: Nominal arm, without effects.
        q: Planned joint positions at the targets [rad or m].
        evaluation_q: Joint positions of the poses that matter [rad or m].
        errors: Maximum manufacturing errors of lengths [m] and angles [rad].
        sigmas: Standard deviations of the tool's position [m] and rotation [rad] at every target, by source.
        joint_sigma: Of a joint's reading [rad or m].
        only: The one source of error that acts, weighted as if all did; all if empty.
    """

    robot: Robot
    plate: Plate
    q: Float[np.ndarray, "targets n"]
    evaluation_q: Float[np.ndarray, "rows n"]
    made: tuple[float, float]
    sigmas: Mapping[str, Float[np.ndarray, "targets 2"]]
    joint_sigma: float = 0.0
    only: str = ""

    @property
    def sources(self) -> tuple[str, ...]:
        return (*self.sigmas, JOINTS) if self.joint_sigma else tuple(self.sigmas)

    def judged_arm(self, seed: np.random.SeedSequence) -> tuple[np.ndarray, np.ndarray]:
        """Whether one arm met each target within its limits, and its errors [m, rad] in the region."""
        rng = np.random.default_rng(seed)
        actual = virtual_arm(self.robot, rng=rng, errors=self.made)
        met, rows = self._visited(actual, rng)
        calibrated = self._calibrated(rows.take(met)) if met.any() else self.robot
        poses = Motion(self.evaluation_q[rng.integers(0, len(self.evaluation_q), JUDGED)])
        return met, se3.pose_error(tool_poses(actual, poses), tool_poses(calibrated, poses))

    def _visited(self, actual: Robot, rng: np.random.Generator) -> tuple[np.ndarray, Dataset]:
        """Which targets the arm meets, and its readings at the targets as drawn."""
        drawn, none = self.robot.base.pose @ self.plate.poses, np.zeros((len(self.plate), 2))
        acting, every = (
            np.sqrt(sum((each**2 for name, each in self.sigmas.items() if only in ("", name)), none))
            for only in (self.only, "")
        )
        off = rng.normal(size=(len(drawn), 6)) * np.repeat(acting, 3, axis=1)
        turned = se3.rotvec_to_matrix(off[:, 3:]) @ drawn[:, :3, :3]
        task = None if self.plate.has_seats else Task.POSITION
        found = follow_many(actual, se3.pose(turned, drawn[:, :3, 3] + off[:, :3]), self.q, task=task)
        weighted, joints = np.maximum(every, EXACT), self.joint_sigma * (self.only in ("", JOINTS))
        weighted[[target.kind is not Kind.SEAT for target in self.plate.targets], 1] = UNSEEN
        return found.converged, Dataset(
            q=found.q + joints * rng.normal(size=found.q.shape),
            row=np.arange(len(drawn)),
            position=drawn[:, :3, 3],
            rotation=drawn[:, :3, :3],
            sigma=np.repeat(weighted, 3, axis=1),
        )

    def _calibrated(self, rows: Dataset) -> Robot:
        problem = Problem.build(self.robot, rows, noise=Noise(EXACT, EXACT))
        length, angle = self.made
        bounds = np.array([angle if p.unit == "rad" else length for p in problem.parameters])
        prior = np.diag(np.sqrt(3.0) / np.maximum(bounds, EXACT))
        problem = problem.with_prior(problem.names, problem.start, prior)
        return self.robot.with_values(problem.named(Ols().search(problem).x))


def judge_arms(trial: Trial, seeds: Sequence[np.random.SeedSequence]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Some arms, alike wherever they are computed: never cut short, and by one thread."""
    with one_thread(), running():
        return [trial.judged_arm(seed) for seed in seeds]


PIECE = 50
"""Arms that are computed together, in one process."""
ALONE = 200
"""Arms for each source of error alone."""
Errors = Float[np.ndarray, "arms poses 6"]
"""Position [m] and rotation [rad]."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Yield(AbstractShown):
    """What a trial of many virtual arms shows of a plate.

    Args:
        wanted: What every pose of an arm had to keep.
        met: Whether an arm met a target within its limits; it is calibrated with these.
        errors: At poses of the region.
        sources: Errors of some arms with each source of error alone.
        assumptions: What goes wrong at the targets: instrument, production, play; the arms' errors too.
    """

    wanted: Wanted
    met: Bool[np.ndarray, "arms targets"]
    errors: Errors
    sources: Mapping[str, Errors]
    assumptions: str

    @property
    def used(self) -> Float[np.ndarray, " arms"]:
        """Each arm's largest error as a share of what the requirement allows."""
        return self.wanted.used_by(self.errors[..., :3], self.errors[..., 3:]).max(-1)

    @property
    def share(self) -> float:
        return float((self.used <= 1.0).mean())

    @property
    def interval(self) -> tuple[float, float]:
        """Its 95 % confidence interval (Clopper and Pearson)."""
        from scipy.stats import binomtest

        low, high = binomtest(int((self.used <= 1.0).sum()), len(self.met)).proportion_ci()
        return float(low), float(high)

    @property
    def unreached(self) -> int:
        """Arms that are calibrated with fewer targets than the plate has."""
        return int((~self.met.all(axis=1)).sum())

    @property
    def blame(self) -> str:
        """The dominant source of error of the position; empty if nothing goes wrong."""
        return max(self.sources, key=lambda name: rms_of(self.sources[name])["position_rms_mm"], default="")

    @property
    def text(self) -> str:
        """One sentence for people."""
        low, high = self.interval
        text = (
            f"{100 * self.share:.1f} % of {len(self.met)} virtual arms meet {self.wanted.text} everywhere in "
            f"the region (95 % confidence {100 * low:.1f} … {100 * high:.1f} %)"
        )
        if self.unreached:
            text += f"; {self.unreached} of them are calibrated with the targets that they reach"
        return f"{text}; the {self.blame} dominates" if self.blame else text

    def blocks(self) -> list[Block]:
        sizes = {"all errors": self.errors} | {f"{name} alone": each for name, each in self.sources.items()}
        found = {name: rms_of(errors).values() for name, errors in sizes.items()}
        lines = [f"{name}: {mm:.3f} mm, {deg:.3f}° rms" for name, (mm, deg) in found.items()]
        return [*map(Sentence, [self.text, *lines, f"errors include: {self.assumptions}"])]

    def json(self) -> Json:
        return document(
            "workbench.plate-yield/1",
            arms=len(self.met),
            holds=self.assumptions,
            requirement=self.wanted.json(),
            share=self.share,
            share_95=self.interval,
            not_reached=self.unreached,
            **rms_of(self.errors),
            sources={name: rms_of(errors) for name, errors in self.sources.items()},
        )


def rms_of(errors: Errors) -> dict[str, float]:
    """Of position [mm] and orientation [°]."""
    position, rotation = np.sqrt((errors.reshape(-1, 2, 3) ** 2).sum(-1).mean(0)).tolist()
    return {"position_rms_mm": 1e3 * position, "orientation_rms_deg": float(np.rad2deg(rotation))}


@checked_arguments()
@one_thread()
def try_plate(
    robot: RobotLike,
    plate: PlateLike,
    *,
    arms: Count = 10_000,
    sigma: Like[Sigma] | None = None,
    joint_sigma: Like[Angle] = 0.0,
    errors: Like[LengthAndAngle] = LIKELY_ERRORS,
    wanted: WantedLike | None = None,
    towards: PlateLike | None = None,
    poses: Count = 500,
    scheduler: str | None = None,
    seed: Seed = 0,
) -> Yield:
    """How many arms of a production run meet the requirement after a calibration with a plate.

    Args:
        robot: Nominal arm with limits.
        plate: Targets and region; targets without joint positions take the branches that tell most.
        arms: How many virtual arms.
        sigma: How well a target returns and is read: standard deviations [m], [rad]; usual ones of what is
            read at the targets if None.
        joint_sigma: Of the joint readings [rad or m].
        errors: Maximum manufacturing errors of lengths [m] and angles [rad]; 5 mm and 5° in ARIA §2.4.
        wanted: What every pose has to keep; ARIA eq. (3) if None.
        towards: Plate about whose targets' orientations the poses of the region are turned by up to 60°, so
            that plates compare; this one if None.
        poses: Poses of the tool in the region, in all their branches, at which arms are judged.
        scheduler: Address of a Dask scheduler; this machine's cores if None.
        seed: Of everything random: the result depends on the arguments alone, not on where it is computed.
    """
    check_tried(robot, plate)
    sigma = sigma_of(usual_kind(plate), sigma)
    planned = [target.q for target in plate.targets if target.q is not None]
    if len(planned) < len(plate):
        with part_of(0.0, 0.0):
            scored = score(robot, plate, sigma=sigma)
        if scored.left_out:
            raise DataError(f"{scored.left_out}; move what is left out, then try the plate")
        planned = [*scored.measured.q]
    region = plate if towards is None else replace(towards, region=plate.region)
    causes = {"instrument": np.tile(sigma, (len(plate), 1)), "manufacture": plate.known, "play": plate.play}
    trial = Trial(
        robot=replace(robot, effects=()),
        plate=plate,
        q=np.stack(planned),
        evaluation_q=plate_region_poses(robot, region, poses),
        made=errors,
        sigmas={name: each for name, each in causes.items() if each.any()},
        joint_sigma=joint_sigma,
    )
    seeds = np.random.SeedSequence(seed).spawn(max(arms, ALONE))
    alone = ((replace(trial, only=name), seeds[:ALONE]) for name in trial.sources)
    runs = [(trial, seeds[:arms]), *alone]
    pieces = [(run, own[i : i + PIECE]) for run, own in runs for i in range(0, len(own), PIECE)]
    done = spread(judge_arms, pieces, scheduler=scheduler, text=f"trying {plural(arms, 'arm')}")
    met, off = (np.stack(parts) for parts in zip(*chain.from_iterable(done), strict=True))
    joints = f"; joint readings {np.rad2deg(joint_sigma):.2g}°" if joint_sigma else ""
    return Yield(
        wanted=wanted or Requirement().wanted,
        met=met[:arms],
        errors=off[:arms],
        sources={name: off[arms + i * ALONE :][:ALONE] for i, name in enumerate(trial.sources)},
        assumptions=assumptions(plate, sigma) + joints,
    )


def check_tried(robot: Robot, plate: Plate) -> None:
    """Refuse a plate that virtual arms can't be tried on."""
    plate.check_targets()
    if plate.has_seats and robot.dof < 6:
        text = f"robot '{robot.name}' has {robot.dof} joints and can't sit in a seat"
        raise DataError(f"{text}; try a plate of sockets or points", found=robot.dof)

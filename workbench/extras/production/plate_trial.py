"""Trying a plate on virtual arms: how many of a production run meet the requirement, and what is to blame."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import chain
from typing import final

import numpy as np
from jaxtyping import Bool, Float
from rich.text import Text
from scipy import special

from workbench.arm.robot import Robot
from workbench.base.argument_checks import Angle, Length, LengthAndAngle, Like, Seed
from workbench.base.errors import DataError, OptionError
from workbench.base.parallel import spread
from workbench.base.progress import part_of
from workbench.base.threads import one_thread
from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Requirement, Wanted
from workbench.data.simulation.simulate import ANGLE_ERROR, MAX_LENGTH_ERROR
from workbench.extras.production.virtual_arms import Trial, judge_arms
from workbench.plate.argument_types import checked_arguments
from workbench.plate.plate import Plate
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.score import score
from workbench.plate.target_readings import assumptions, usual_sigma
from workbench.report.json import Json, document
from workbench.report.result_display import AbstractShown

PIECE = 50
"""Arms that are computed together, in one process."""
ALONE = 200
"""Arms for each source of error alone."""
TAIL = 0.025
"""Outside of each end of the interval of the share of arms."""
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
        left_out: Targets that can't be measured, in a sentence; empty if all can.
    """

    wanted: Wanted
    met: Bool[np.ndarray, "arms targets"]
    errors: Errors
    sources: Mapping[str, Errors]
    assumptions: str
    left_out: str = ""

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
        good = int((self.used <= 1.0).sum())
        bad = len(self.met) - good
        low = special.betaincinv(good, bad + 1, TAIL) if good else 0.0
        high = special.betaincinv(good + 1, bad, 1.0 - TAIL) if bad else 1.0
        return float(low), float(high)

    @property
    def unreached(self) -> int:
        """Arms that are calibrated with fewer targets than the plate has."""
        return int((~self.met.all(axis=1)).sum())

    @property
    def position(self) -> Float[np.ndarray, " arms"]:
        """Root mean square position error of each arm [m]."""
        return np.sqrt((self.errors[..., :3] ** 2).sum(-1).mean(-1))

    @property
    def blame(self) -> str:
        """The dominant source of error of the position; empty if nothing goes wrong."""
        return max(self.sources, key=lambda name: _sizes(self.sources[name])["position_rms_mm"], default="")

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

    def summary(self) -> Text:
        arms = "{:.3f}, {:.3f}, {:.3f} mm".format(*1e3 * np.percentile(self.position, [50, 95, 100]))
        lines = [self.text, f"all errors: {_rms_text(self.errors)}; median, 95 % and worst arm: {arms}"]
        lines += [f"{name} alone: {_rms_text(errors)}" for name, errors in self.sources.items()]
        return Text("\n".join([*lines, f"errors include: {self.assumptions}", self.left_out]).strip())

    def json(self) -> Json:
        return document(
            "workbench.plate-yield/1",
            arms=len(self.met),
            holds=self.assumptions,
            requirement=self.wanted.json(),
            share=self.share,
            share_95=self.interval,
            not_reached=self.unreached,
            **_sizes(self.errors),
            sources={name: _sizes(errors) for name, errors in self.sources.items()},
            left_out=self.left_out,
        )


def _sizes(errors: Errors) -> dict[str, float]:
    """Root mean squares."""
    position, rotation = np.sqrt((errors.reshape(-1, 2, 3) ** 2).sum(-1).mean(0)).tolist()
    return {"position_rms_mm": 1e3 * position, "orientation_rms_deg": float(np.rad2deg(rotation))}


def _rms_text(errors: Errors) -> str:
    return "{:.3f} mm, {:.3f}° rms".format(*_sizes(errors).values())


@checked_arguments()
@one_thread()
def try_plate(
    robot: Like[Robot],
    plate: Like[Plate],
    *,
    arms: int = 10_000,
    sigma: Like[LengthAndAngle] | None = None,
    joint_sigma: float = 0.0,
    length: Like[Length] = MAX_LENGTH_ERROR,
    angle: Like[Angle] = ANGLE_ERROR,
    wanted: Like[Wanted] | None = None,
    towards: Like[Plate] | None = None,
    poses: int = 500,
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
        length: Maximum manufacturing error of a length [m]; 5 mm in ARIA §2.4.
        angle: Maximum manufacturing error of an angle [rad]; 5° there.
        wanted: What every pose has to keep; ARIA eq. (3) if None.
        towards: Plate about whose targets' orientations the poses of the region are turned by up to 60°, so
            that plates compare; this one if None.
        poses: Poses of the tool in the region, in all their branches, at which arms are judged.
        scheduler: Address of a Dask scheduler; this machine's cores if None.
        seed: Of everything random: the result depends on the arguments alone, not on where it is computed.
    """
    for name, number in (("arms", arms), ("poses", poses)):
        if number < 1:
            raise OptionError(f"{name} must be at least 1, got {number}", option=name, found=number)
    check_tried(robot, plate)
    sigma = sigma or usual_sigma(plate)
    with part_of(0.0, 0.0):
        scored = score(robot, plate, sigma=sigma)
    plate = scored.can.plate
    region = plate if towards is None else replace(towards, region=plate.region)
    causes = {"instrument": np.tile(sigma, (len(plate), 1)), "manufacture": plate.known, "play": plate.play}
    trial = Trial(
        robot=replace(robot, effects=()),
        plate=plate,
        q=scored.measured.q[scored.can.rows],
        evaluation_q=plate_region_poses(robot, region, poses),
        made=(length, angle),
        sigmas={name: each for name, each in causes.items() if each.any()},
        joint_sigma=joint_sigma,
    )
    alone, seeds = each_alone(trial), np.random.SeedSequence(seed).spawn(max(arms, ALONE))
    runs = [(trial, seeds[:arms]), *((only, seeds[:ALONE]) for only in alone.values())]
    pieces = [(run, own[i : i + PIECE]) for run, own in runs for i in range(0, len(own), PIECE)]
    done = spread(judge_arms, pieces, scheduler=scheduler, text=f"trying {plural(arms, 'arm')}")
    met, errors = (np.stack(parts) for parts in zip(*chain.from_iterable(done), strict=True))
    joints = f"; joint readings {np.rad2deg(joint_sigma):.2g}°" if joint_sigma else ""
    return Yield(
        wanted=wanted or Requirement().wanted,
        met=met[:arms],
        errors=errors[:arms],
        sources=dict(zip(alone, errors[arms:].reshape(len(alone), ALONE, *errors.shape[1:]), strict=True)),
        assumptions=assumptions(plate, sigma) + joints,
        left_out=scored.left_out,
    )


def each_alone(trial: Trial) -> dict[str, Trial]:
    """The trial with each source of error that there is, and no other."""
    exact = replace(trial, sigmas={}, joint_sigma=0.0)
    alone = {name: replace(exact, sigmas={name: sigma}) for name, sigma in trial.sigmas.items()}
    return alone | ({"joint readings": replace(trial, sigmas={})} if trial.joint_sigma else {})


def check_tried(robot: Robot, plate: Plate) -> None:
    """Refuse a plate that virtual arms can't be tried on."""
    if plate.anchors is not None:
        raise DataError(
            f"plate '{plate.name}' is read by a ball-bar; only seats, sockets and points can be tried"
        )
    if plate.has_seats and robot.dof < 6:
        raise DataError(
            f"robot '{robot.name}' has {robot.dof} joints and can't sit in a seat; "
            "try a plate of sockets or points",
            found=robot.dof,
        )

"""Virtual arms: each is made, brought to the targets of a plate, calibrated there and judged in its region.

    made        every free constant off evenly within ±1 mm, ±0.3°, or what is given
    measured    the joints of the actual arm at the actual targets, next to the planned ones
    calibrated  by OLS like measured rows, the plate taken as true; a prior, σ = bound/√3, keeps near nominal
                what the targets leave open
    judged      at poses of the region that took no part

Source: ARIA §4.1.2 (second way of acquisition), eqs. (19)–(21), §2.4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.follow import follow_many
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.progress import running
from workbench.base.threads import one_thread
from workbench.data.dataset import Dataset
from workbench.data.simulation.simulate import virtual_arm
from workbench.identification.algorithms.ols import Ols
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import Noise
from workbench.plate.plate import Kind, Plate

JUDGED = 48
"""Poses of the region at which each arm is judged."""
EXACT, UNSEEN = 1e-9, 1e3
"""Standard deviations by which exact readings, and angles that are not read, are weighted [m or rad]."""


Judged = tuple[Bool[np.ndarray, " targets"], Float[np.ndarray, "poses 6"]]
"""Whether an arm met each target within its limits, and its errors [m, rad] at poses of the region."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Trial:
    """Where virtual arms are calibrated and judged, and what goes wrong.

    Args:
        robot: Nominal arm, without effects.
        q: Planned joint positions at the targets [rad or m].
        evaluation_q: Joint positions of the poses that matter [rad or m].
        made: Maximum manufacturing errors of lengths [m] and angles [rad].
        sigmas: Standard deviations of the tool's position [m] and rotation [rad] at every target, by source.
        joint_sigma: Of a joint's reading [rad or m].
    """

    robot: Robot
    plate: Plate
    q: Float[np.ndarray, "targets n"]
    evaluation_q: Float[np.ndarray, "rows n"]
    made: tuple[float, float]
    sigmas: Mapping[str, Float[np.ndarray, "targets 2"]]
    joint_sigma: float = 0.0

    def judged_arm(self, seed: np.random.SeedSequence) -> Judged:
        """One arm, from its manufacture to its errors."""
        rng = np.random.default_rng(seed)
        actual = virtual_arm(self.robot, rng=rng, length=self.made[0], angle=self.made[1])
        met, rows = self._visited(actual, rng)
        calibrated = self._calibrated(rows.take(met)) if met.any() else self.robot
        poses = Motion(self.evaluation_q[rng.integers(0, len(self.evaluation_q), JUDGED)])
        return met, se3.pose_error(tool_poses(actual, poses), tool_poses(calibrated, poses))

    def _visited(self, actual: Robot, rng: np.random.Generator) -> tuple[np.ndarray, Dataset]:
        """Which targets the arm meets, and its readings at the targets as drawn."""
        sigma = np.sqrt(sum((each**2 for each in self.sigmas.values()), np.zeros((len(self.plate), 2))))
        drawn = self.robot.base.pose @ self.plate.poses
        off = rng.normal(size=(len(drawn), 6)) * np.repeat(sigma, 3, axis=1)
        turned = se3.rotvec_to_matrix(off[:, 3:]) @ drawn[:, :3, :3]
        task = None if self.plate.has_seats else Task.POSITION
        found = follow_many(actual, se3.pose(turned, drawn[:, :3, 3] + off[:, :3]), self.q, task=task)
        weighted = np.maximum(sigma, EXACT)
        weighted[[target.kind is not Kind.SEAT for target in self.plate.targets], 1] = UNSEEN
        return found.converged, Dataset(
            q=found.q + self.joint_sigma * rng.normal(size=found.q.shape),
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


def judge_arms(trial: Trial, seeds: Sequence[np.random.SeedSequence]) -> list[Judged]:
    """Some arms, alike wherever they are computed: never cut short, and by one thread."""
    with one_thread(), running():
        return [trial.judged_arm(seed) for seed in seeds]

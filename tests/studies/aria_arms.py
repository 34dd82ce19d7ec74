"""Many virtual arms, calibrated from three kinds of data: the comparison of ARIA Fig. 7.

Every arm has its own hidden manufacturing errors (5 mm, 5°, §2.4). It is measured at ten poses of each kind
and identified by OLS, OPT1 and OPT2. Judged are the errors at the ten poses themselves, as the paper does,
and, which the paper does not, those at poses of the region that were not measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench import Dataset, Instrument, Motion, Robot, tool_poses
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.progress import cancelled, progress, running
from workbench.data.prediction import row_components
from workbench.data.simulation.simulate import simulate, simulate_targets, virtual_arm
from workbench.identification.algorithms import ALGORITHMS
from workbench.identification.problem import Noise, Problem

THREE = tuple(ALGORITHMS[name] for name in ("ols", "opt1", "opt2"))
"""The algorithms of the paper's toolbox, §4.1.3."""
LENGTH_ERROR, ANGLE_ERROR = 5e-3, float(np.deg2rad(5.0))
"""Of manufacture, at most [m], [rad] (§2.4)."""
TITLES = ("NOM", *(algorithm.title for algorithm in THREE))
"""The nominal arm, then the algorithms, as the columns of Fig. 7."""
WEIGHTS = Noise(1e-4, float(np.deg2rad(0.02)))
"""Standard deviations that weigh position and rotation [m], [rad]; a plate's."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Acquisition:
    """Ten poses at which an arm is measured.

    Args:
        title: For people.
        q: Joint positions of the nominal arm [rad or m].
        imposed: Poses of the tool that a calibration tool imposes, in the robot's base; None where the arm
            goes to the joint positions and an instrument measures it there.
    """

    title: str
    q: Float[np.ndarray, "poses n"]
    imposed: Float[np.ndarray, "poses 4 4"] | None = None

    def measure(self, actual: Robot, instrument: Instrument, rng: np.random.Generator) -> Dataset:
        """The rows of one arm."""
        if self.imposed is None:
            return simulate(actual, Motion(self.q), instrument=instrument, rng=rng)
        return simulate_targets(actual, self.imposed, instrument=instrument, rng=rng, near=self.q)


@dataclass(frozen=True, eq=False, kw_only=True)
class Comparison:
    """Errors of all arms: one row an arm, one column for NOM and each algorithm.

    Args:
        acquisition: What was measured.
        instrument: What measured it.
        own_position: Greatest entry of e_p at the measured poses [m]; NaN for an arm that does not reach
            them.
        own_rotation: Greatest entry of e_ρ there [rad].
        region: Mean position error at poses in the region that were not measured [m].
    """

    acquisition: Acquisition
    instrument: Instrument
    own_position: Float[np.ndarray, "arms columns"]
    own_rotation: Float[np.ndarray, "arms columns"]
    region: Float[np.ndarray, "arms columns"]

    @property
    def reached(self) -> int:
        """Arms that reach every pose."""
        return int(np.isfinite(self.own_position[:, 0]).sum())

    def within(self, position: float, rotation: float) -> float:
        """Share of the arms whose every error at the measured poses is below the limits, worst algorithm."""
        done = np.isfinite(self.own_position[:, 0])
        ok = (self.own_position[done, 1:] < position) & (self.own_rotation[done, 1:] < rotation)
        return float(ok.all(1).mean()) if done.any() else float("nan")


def compare_acquisitions(
    robot: Robot,
    acquisitions: Sequence[Acquisition],
    instrument: Instrument,
    judges: Float[np.ndarray, "rows n"],
    *,
    arms: int,
    seed: int = 0,
) -> tuple[Comparison, ...]:
    """Measure and identify many virtual arms in every way; the same arms for all."""
    shape = (arms, len(acquisitions), len(TITLES))
    tables = {name: np.full(shape, np.nan) for name in ("own_p", "own_r", "region")}
    for arm in range(arms):
        if cancelled():
            break
        progress(arm / arms, f"{instrument.name}: virtual arm {arm + 1} of {arms}")
        rng = np.random.default_rng([seed, arm])
        actual = virtual_arm(robot, rng=rng, errors=(LENGTH_ERROR, ANGLE_ERROR))
        for k, acquisition in enumerate(acquisitions):
            try:
                rows = acquisition.measure(actual, instrument, rng)
            except DataError:
                continue
            with running():  # an arm is done or not
                models = identified(robot, rows)
            components = tuple(row_components(model, rows) for model in models)
            tables["own_p"][arm, k] = [np.abs(c.position).max() for c in components]
            tables["own_r"][arm, k] = [np.abs(c.rotation).max() for c in components]
            tables["region"][arm, k] = [mean_errors(actual, model, judges)[0] for model in models]
    return tuple(
        Comparison(
            acquisition=acquisition,
            instrument=instrument,
            own_position=tables["own_p"][:, k],
            own_rotation=tables["own_r"][:, k],
            region=tables["region"][:, k],
        )
        for k, acquisition in enumerate(acquisitions)
    )


def identified(robot: Robot, rows: Dataset) -> tuple[Robot, ...]:
    """The nominal arm, and what each algorithm makes of the rows; base and tool are known."""
    problem = Problem.build(robot, rows, noise=WEIGHTS)
    return robot, *(problem.robot_at(a.search(problem).x) for a in THREE)


def mean_errors(actual: Robot, model: Robot, q: Float[np.ndarray, "rows n"]) -> tuple[float, float]:
    """Mean position [m] and orientation [rad] error of a model at joint positions."""
    errors = se3.pose_error(tool_poses(actual, Motion(q)), tool_poses(model, Motion(q)))
    return float(np.linalg.norm(errors[:, :3], axis=1).mean()), float(
        np.linalg.norm(errors[:, 3:], axis=1).mean()
    )

"""Gravity in a direction that the file doesn't state, from the loads through soft joints.

What joints give way is bilinear in compliances and gravity: with the moments τ_jk of gravity along axis k of
the base, joint j turns by −c_j Σ_k d_k τ_jk. So the columns of all joints and axes tell for every direction d
how much of the error soft joints explain, c_j ≥ 0. The six axes and the arm's own direction are where d
begins: from there c and d are found in turn.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import linalg, optimize

from workbench.base.types import Vector3
from workbench.diagnosis.confidence import CERTAIN
from workbench.diagnosis.drivers.driver import Driver, Shape, driver_of
from workbench.diagnosis.drivers.evidence import DriverEvidence, evidence_of
from workbench.diagnosis.search.evidence import JITTER, drop, factored, is_nameless, left_of
from workbench.diagnosis.search.stepwise_search import group_evidence

TURNS = 30
"""Number of turns in which compliances and direction are found."""


class LoadsByAxis(NamedTuple):
    """What loads under gravity along each axis explain.

    Args:
        inner: Inner products of the columns of J joints and three axes.
        along: Theirs with the error.
    """

    inner: Float[np.ndarray, "j 3 j 3"]
    along: Float[np.ndarray, "j 3"]

    def explained(self, direction: Vector3) -> tuple[float, np.ndarray]:
        """Square that joints explain under gravity in a direction, and their compliances."""
        inner = np.einsum("a,iajb,b->ij", direction, self.inner, direction)
        root, scale = factored(inner + JITTER * np.trace(inner) * np.eye(len(inner)))
        right = linalg.solve_triangular(root, scale * (self.along @ direction), lower=True)
        found, left = optimize.nnls(root.T, right)
        return float(right @ right - left**2), scale * found

    def likeliest(self, direction: Vector3) -> tuple[float, Vector3]:
        """The best direction that is found from one."""
        for _ in range(TURNS):
            give = self.explained(direction)[1]
            if not give.any():
                break
            inner = np.einsum("i,iajb,j->ab", give, self.inner, give)
            found = np.linalg.lstsq(inner, give @ self.along, rcond=None)[0]
            direction = found / np.linalg.norm(found)
        return self.explained(direction)[0], direction


def gravity_elsewhere(drivers: DriverEvidence) -> Vector3 | None:
    """Gravity in another direction than the arm's, if only this makes its loads explain an error: more than
    all loads and nameless terms of the model, or a pull on the tool, do; in the axes of the base [m/s²]."""
    processes = [f for f in drivers.followers if f.shape is Shape.TURNED]
    if not processes or drivers.problem.frames.levelled or not drivers.problem.robot.has_masses:
        return None
    model, grams = drivers.searched.model, drivers.grams
    gone = tuple(t for t in model if is_nameless(t) or driver_of(t.candidate.effect) is Driver.LOAD)
    left = left_of(grams, drop(model, gone))
    names = [n for f in processes for n in f.candidate.names]
    columns, scale, count = grams.columns(names), grams.scales(names), len(processes)
    inner = (left.inner(columns) * scale[:, None] * scale).reshape(count, 3, count, 3)
    loads = LoadsByAxis(inner, (left.along(columns) * scale).reshape(count, 3))
    stated = drivers.problem.robot_at(drivers.searched.stage.fit.x).gravity
    size = float(np.linalg.norm(stated))
    begins = (stated / size, *np.eye(3), *-np.eye(3))
    square, best = max((loads.likeliest(d) for d in begins), key=lambda each: each[0])

    def gain(explained: float, freedom: int) -> float:
        rest = max(left.square - explained, 1e-300)
        return 0.5 * left.freedom * np.log(left.square / rest) - 0.5 * freedom * np.log(grams.count)

    own = gain(loads.explained(stated / size)[0], count)
    rival = max(own, group_evidence(left, gone), evidence_of(left, drivers.pulls))
    return size * best if gain(square, count + 2) > rival + np.log(CERTAIN) else None

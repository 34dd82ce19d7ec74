"""The trial: how many arms of a production meet the requirement, where they are how good, and what to blame.

Virtual arms come in chunks with seeds of their own, and a few for each source of error alone. The chunks are
spread over the cores of this machine, or a Dask cluster; their seeds are among their arguments, so that the
numbers are the same wherever they run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import special

from workbench.base.errors import OptionError
from workbench.base.parallel import spread
from workbench.base.types import Outcome, frozen
from workbench.base.wording import plural, ranges
from workbench.data.accuracy_requirement import Wanted
from workbench.extras.production.virtual_arms import CHUNK, Chunk, try_arms
from workbench.extras.production.yield_inputs import YieldJob, check_job

CONFIDENCE = 0.95
"""Of the interval of the share of arms."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Yield:
    """What a trial of many virtual arms shows of a plate; arms in the order of their seeds.

    Args:
        wanted: What every pose of an arm had to keep.
        reached: Arms that met all targets within their joint limits; the others are calibrated with fewer.
        planned: Arms that did so in the planned branches.
        position: Root mean square position error of each arm in the region [m].
        rotation: And rotation error [rad].
        worst: Maximum error of each arm along any axis: position [m], rotation [rad].
        used: Each arm's largest error at its judged poses, as a share of what the requirement allows.
        cells: Cubes of the region that were judged.
        predicted: Predicted root mean square errors in each of these cubes [m], [rad].
        observed: Those of the arms in the planned branches.
        samples: How many errors stand behind each cube.
        sources: Root mean square position [m] and rotation error [rad] with each source of error alone.
        outcome: Whether all arms were tried.
        assumptions: What goes wrong at the targets: instrument, production, play; the arms' errors too.
        notes: What limits the trial, one sentence each.
    """

    wanted: Wanted
    reached: Bool[np.ndarray, " arms"]
    planned: Bool[np.ndarray, " arms"]
    position: Float[np.ndarray, " arms"]
    rotation: Float[np.ndarray, " arms"]
    worst: Float[np.ndarray, "arms 2"]
    used: Float[np.ndarray, " arms"]
    cells: Int[np.ndarray, " cubes"]
    predicted: Float[np.ndarray, "cubes 2"]
    observed: Float[np.ndarray, "cubes 2"]
    samples: Int[np.ndarray, " cubes"]
    sources: Mapping[str, tuple[float, float]]
    outcome: Outcome = Outcome.CONVERGED
    assumptions: str = ""
    notes: tuple[str, ...] = ()

    @property
    def arms(self) -> int:
        return len(self.reached)

    @cached_property
    def passed(self) -> Bool[np.ndarray, " arms"]:
        return frozen(self.used <= 1.0)

    @property
    def share(self) -> float:
        return float(self.passed.mean())

    @property
    def interval(self) -> tuple[float, float]:
        """Its 95 % confidence interval (Clopper and Pearson)."""
        good, bad, tail = int(self.passed.sum()), int((~self.passed).sum()), 0.5 * (1.0 - CONFIDENCE)
        low = special.betaincinv(good, bad + 1, tail) if good else 0.0
        high = special.betaincinv(good + 1, bad, 1.0 - tail) if bad else 1.0
        return float(low), float(high)

    @property
    def position_rms(self) -> float:
        return float(np.sqrt(np.mean(self.position**2)))

    @property
    def rotation_rms(self) -> float:
        return float(np.sqrt(np.mean(self.rotation**2)))

    @property
    def agreement(self) -> Float[np.ndarray, "cubes 2"]:
        """Observed by predicted error of each cube, position and rotation."""
        return self.observed / self.predicted

    @property
    def blame(self) -> str | None:
        """The dominant source of error of the position; None if nothing goes wrong."""
        return max(self.sources, key=lambda name: self.sources[name][0], default=None)

    @property
    def shares(self) -> dict[str, float]:
        """Each source's share of the mean square position error, as if they were independent."""
        total = sum(position**2 for position, _ in self.sources.values())
        return {name: position**2 / total for name, (position, _) in self.sources.items() if total > 0.0}


def gather(
    job: YieldJob,
    chunks: Sequence[Chunk],
    sources: Mapping[str, tuple[float, float]],
    *,
    outcome: Outcome = Outcome.CONVERGED,
) -> Yield:
    """The yield of all chunks, in their order.

    Args:
        chunks: Of the arms.
        sources: Errors with each source alone [m], [rad].
        outcome: Whether all arms were tried.
    """
    counts = np.sum([chunk.counts for chunk in chunks], axis=0)
    squares = np.sum([chunk.squares for chunk in chunks], axis=0)
    expected = job.predicted() * counts[:, None]
    met = np.concatenate([chunk.met for chunk in chunks])
    never = (1 + np.flatnonzero(~np.logical_or.reduce(met))).tolist()
    cells, cube = np.unique(job.cells, return_inverse=True)
    samples = np.bincount(cube, counts)
    seen = samples > 0

    def per_cube(sums: np.ndarray) -> np.ndarray:
        both = [np.bincount(cube, part)[seen] / samples[seen] for part in sums.T]
        return frozen(np.sqrt(np.stack(both, -1)))

    def joined(name: str) -> Any:
        return frozen(np.concatenate([getattr(chunk, name) for chunk in chunks]))

    return Yield(
        wanted=job.wanted,
        reached=frozen(np.logical_and.reduce(met, axis=1)),
        planned=joined("planned"),
        position=joined("position"),
        rotation=joined("rotation"),
        worst=joined("worst"),
        used=joined("used"),
        cells=frozen(cells[seen]),
        predicted=per_cube(expected),
        observed=per_cube(squares),
        samples=frozen(samples[seen].astype(np.int64)),
        sources=sources,
        outcome=outcome,
        notes=(f"no arm reaches target {ranges(never)}: move it, or its plate",) if never else (),
    )


def rms_of(chunks: Sequence[Chunk]) -> tuple[float, float]:
    """Root mean square position [m] and rotation error [rad] of the arms."""
    position = np.concatenate([chunk.position for chunk in chunks])
    rotation = np.concatenate([chunk.rotation for chunk in chunks])
    return float(np.sqrt(np.mean(position**2))), float(np.sqrt(np.mean(rotation**2)))


ARMS = 10_000
"""Arms of a trial by default."""
ALONE = 2
"""Chunks for each source of error alone."""


def try_production(job: YieldJob, *, arms: int = ARMS, seed: int = 0, scheduler: str | None = None) -> Yield:
    """Make, measure, calibrate and judge many virtual arms.

    The numbers depend on the seed and the number of arms alone, not on where or in which order they are
    computed.

    Args:
        scheduler: Address of a Dask scheduler; this machine's cores if None.
    """
    check_number(arms)
    check_job(job)
    alone = job.errors.alone()
    sizes = [min(CHUNK, arms - start) for start in range(0, arms, CHUNK)]
    seeds = np.random.SeedSequence(seed).spawn(len(sizes) + ALONE)
    pieces = [(job, s, n) for s, n in zip(seeds, sizes, strict=False)]
    for errors in alone.values():
        pieces += [(replace(job, errors=errors), s, CHUNK) for s in seeds[len(sizes) :]]
    done = spread(try_arms, pieces, scheduler=scheduler, text=f"trying {plural(arms, 'arm')}")
    outcome = Outcome.CONVERGED if len(done) == len(pieces) else Outcome.CANCELLED
    return gather(job, done[: len(sizes)], _sources(alone, done[len(sizes) :]), outcome=outcome)


def check_number(arms: int) -> None:
    """Refuse a trial without arms."""
    if arms < 1:
        raise OptionError(f"arms (--arms) must be at least 1, got {arms}", option="arms", found=arms)


def _sources(alone: dict, chunks: list[Chunk]) -> dict[str, tuple[float, float]]:
    """Errors with each source alone, of those that were done."""
    parts = [chunks[i : i + ALONE] for i in range(0, len(chunks), ALONE)]
    return {name: rms_of(part) for name, part in zip(alone, parts, strict=False) if len(part) == ALONE}

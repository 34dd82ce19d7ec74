"""The trial: virtual arms in chunks with seeds of their own, and a few for each source of error alone.

The chunks are spread over the cores of this machine, or a Dask cluster; their seeds are among their
arguments, so that the numbers are the same wherever they run.
"""

from dataclasses import replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.progress import Cancel, Progress
from workbench.base.spread import spread
from workbench.base.types import Outcome
from workbench.plate.yield_trial.arms import CHUNK, Chunk, try_arms
from workbench.plate.yield_trial.job import Job, check_job
from workbench.plate.yield_trial.result import Yield, gather, rms_of

ARMS = 10_000
"""Arms of a trial unless said otherwise."""
ALONE = 2
"""Chunks for each source of error alone."""


def try_production(
    job: Job,
    *,
    arms: int = ARMS,
    seed: int = 0,
    scheduler: str | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Yield:
    """Make, measure, calibrate and judge many virtual arms.

    The numbers depend on the seed and the number of arms alone, not on where or in which order they are
    computed.

    Args:
        scheduler: Address of a Dask scheduler; this machine's cores if None.

    Raises:
        OptionError: no arms, or no scheduler at the address.
        DataError: a plate on which the arm can't be calibrated.
    """
    check_number(arms)
    check_job(job)
    alone = job.errors.alone()
    sizes = [min(CHUNK, arms - start) for start in range(0, arms, CHUNK)]
    seeds = np.random.SeedSequence(seed).spawn(len(sizes) + ALONE)
    pieces = [(job, s, n) for s, n in zip(seeds, sizes, strict=False)]
    for errors in alone.values():
        pieces += [(replace(job, errors=errors), s, CHUNK) for s in seeds[len(sizes) :]]
    done = spread(try_arms, pieces, scheduler=scheduler, progress=progress, cancel=cancel)
    outcome = Outcome.CONVERGED if len(done) == len(pieces) else Outcome.CANCELLED
    return gather(job, done[: len(sizes)], _sources(alone, done[len(sizes) :]), outcome=outcome)


def check_number(arms: int) -> None:
    """Refuse a trial without arms."""
    if arms < 1:
        raise OptionError(f"--arms must be at least 1, got {arms}")


def _sources(alone: dict, chunks: list[Chunk]) -> dict[str, tuple[float, float]]:
    """Errors with each source alone, of those that were done."""
    parts = [chunks[i : i + ALONE] for i in range(0, len(chunks), ALONE)]
    return {name: rms_of(part) for name, part in zip(alone, parts, strict=False) if len(part) == ALONE}

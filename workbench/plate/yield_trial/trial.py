"""The trial: virtual arms in chunks with seeds of their own, and a few for each source of error alone.

The chunks run on all cores of this machine, or on a Dask cluster. Every chunk is a function of its arguments
alone, seeds included, so the numbers are the same wherever it runs, and a chunk whose worker is lost is done
again by another. Results come back in the order of the chunks.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import takewhile
from threading import Event
from typing import Any

import numpy as np
from joblib import Parallel, cpu_count, delayed, parallel_config

from workbench.base.errors import MissingExtraError, OptionError
from workbench.base.types import Outcome
from workbench.plate.yield_trial.arms import CHUNK, Chunk, try_arms
from workbench.plate.yield_trial.job import Job, check_job
from workbench.plate.yield_trial.result import Yield, gather, rms_of

CONNECTING = 5.0
"""Seconds to wait for a scheduler."""
RETRIES = 3
"""How often a piece that failed on a worker is tried again."""
FEW = 2
"""So many pieces are not worth other processes."""

Piece = tuple[Any, ...]


def spread(
    work: Callable[..., Any],
    pieces: Sequence[Piece],
    *,
    scheduler: str | None = None,
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> list[Any]:
    """Results of the work on each piece; if it was cancelled, of those that were begun by then.

    Args:
        work: A function that other processes can import.
        pieces: Its arguments.
        scheduler: Address of a Dask scheduler, such as `tcp://host:8786`; this machine's cores if None.
        progress: Called with the share of the pieces done.
        cancel: Asked after each piece whether to stop.

    Raises:
        MissingExtraError: a scheduler is given, and Dask is not installed.
        OptionError: nobody answers at the scheduler's address.
    """
    stop = Event()
    stream = _here(work, pieces, stop) if scheduler is None else _on_cluster(work, pieces, stop, scheduler)
    results: list[Any] = []
    for result in stream:
        results.append(result)
        if progress is not None:
            progress(len(results) / len(pieces))
        if cancel is not None and cancel():
            stop.set()
    return results


def _here(work: Callable[..., Any], pieces: Sequence[Piece], stop: Event) -> Iterator[Any]:
    cores = 1 if len(pieces) <= FEW else min(cpu_count(), len(pieces))
    tasks = (delayed(work)(*piece) for piece in takewhile(lambda _: not stop.is_set(), pieces))
    with parallel_config(backend="loky", inner_max_num_threads=1):
        yield from Parallel(n_jobs=cores, return_as="generator")(tasks)


def _on_cluster(
    work: Callable[..., Any], pieces: Sequence[Piece], stop: Event, scheduler: str
) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtraError("--scheduler", extra="dask") from None
    try:
        client = Client(scheduler, timeout=CONNECTING, set_as_default=False)
    except (OSError, ValueError) as error:
        raise OptionError(
            f"no Dask scheduler answers at {scheduler} ({error}); start one with `dask scheduler` and give "
            "the address that it prints"
        ) from None
    with client:
        futures = [client.submit(work, *piece, pure=False, retries=RETRIES) for piece in pieces]
        try:
            yield from (future.result() for future in takewhile(lambda _: not stop.is_set(), futures))
        finally:
            client.cancel(futures)


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
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Yield:
    """Make, measure, calibrate and judge many virtual arms.

    The numbers depend on the seed and the number of arms alone, not on where or in which order they are
    computed.

    Args:
        job: The trial.
        arms: How many arms.
        seed: Of everything random.
        scheduler: Address of a Dask scheduler; this machine's cores if None.
        progress: Called with the share of the work done.
        cancel: Asked now and then whether to stop with the arms so far.

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
    """Refuse a trial without arms.

    Raises:
        OptionError: fewer than one.
    """
    if arms < 1:
        raise OptionError(f"--arms must be at least 1, got {arms}")


def _sources(alone: dict, chunks: list[Chunk]) -> dict[str, tuple[float, float]]:
    """Errors with each source alone, of those that were done."""
    parts = [chunks[i : i + ALONE] for i in range(0, len(chunks), ALONE)]
    return {name: rms_of(part) for name, part in zip(alone, parts, strict=False) if len(part) == ALONE}

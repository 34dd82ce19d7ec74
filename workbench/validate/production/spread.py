"""Many equal pieces of work on all cores of this machine, or on a Dask cluster.

Every piece is a function of its arguments alone, seeds included, so the numbers are the same wherever it is
done, and a piece whose worker is lost is done again by another. Results come back in the order of the pieces.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from joblib import Parallel, cpu_count, delayed, parallel_config

from workbench.errors import MissingExtraError, OptionError

CONNECTING = 10.0
"""Seconds to wait for a scheduler."""
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
    """Results of the work on each piece; of the first ones only, if it was cancelled.

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
    run = _here if scheduler is None else _on_cluster
    results: list[Any] = []
    with run(work, pieces, scheduler) as stream:
        for result in stream:
            results.append(result)
            if progress is not None:
                progress(len(results) / len(pieces))
            if cancel is not None and len(results) < len(pieces) and cancel():
                break
    return results


@contextmanager
def _here(work: Callable[..., Any], pieces: Sequence[Piece], _: str | None) -> Iterator[Iterator[Any]]:
    cores = 1 if len(pieces) <= FEW else min(cpu_count(), len(pieces))
    with parallel_config(backend="loky", inner_max_num_threads=1):
        stream = Parallel(n_jobs=cores, return_as="generator")(delayed(work)(*piece) for piece in pieces)
    try:
        yield iter(stream)
    finally:
        stream.close()


@contextmanager
def _on_cluster(
    work: Callable[..., Any], pieces: Sequence[Piece], scheduler: str | None
) -> Iterator[Iterator[Any]]:
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
        futures = [client.submit(work, *piece, pure=False, retries=3) for piece in pieces]
        try:
            yield (future.result() for future in futures)
        finally:
            client.cancel(futures)

"""Parallel work in pieces, on the cores of this machine or on a Dask cluster.

A piece is a function of its arguments alone, so the results are the same wherever it runs, and one whose
worker is lost is done again by another. Results come back in the order of the pieces.
"""

import logging
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from itertools import takewhile
from threading import Event
from typing import Any

from workbench.base.errors import MissingExtraError, OptionError
from workbench.base.installed_package import package_version
from workbench.base.progress import cancelled, progress, running
from workbench.base.threads import one_thread

CONNECTION_TIMEOUT = 5.0
"""Seconds to wait for a scheduler."""
MAX_RETRIES = 3
"""How often a piece that failed on a worker is tried again."""
MIN_LEFT, MIN_LEFT_AT_FIRST = 8.0, 40.0
"""Work that is worth other processes, which need seconds to begin; the first piece may be slow itself [s]."""

Piece = tuple[Any, ...]


def spread(
    work: Callable[..., Any],
    pieces: Sequence[Piece],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    text: str = "",
) -> list[Any]:
    """Results of the work on each piece; if it was cancelled, of those that were begun by then.

    Args:
        work: A function that other processes can import.
        pieces: Its arguments.
        workers: Processes on this machine; as many as it has cores if None.
        scheduler: Address of a Dask scheduler, such as `tcp://host:8786`; this machine's cores if None.
        text: What is being done, to be shown with the share of the pieces done.
    """
    if workers is not None and workers < 1:
        raise OptionError(f"--workers must be at least 1, got {workers}", option="--workers", found=workers)
    stop = Event()
    stream = (
        _here(work, pieces, stop, workers)
        if scheduler is None
        else _on_cluster(work, pieces, stop, scheduler)
    )
    results: list[Any] = []
    for result in stream:
        results.append(result)
        progress(len(results) / len(pieces), text)
        if cancelled():
            stop.set()
    return results


def _here(
    work: Callable[..., Any], pieces: Sequence[Piece], stop: Event, workers: int | None
) -> Iterator[Any]:
    """In this process, until what is left is worth others."""
    from joblib import Parallel, cpu_count, delayed, parallel_config  # no page needs it to begin with

    workers = workers or cpu_count()
    done = 0
    for done, piece in enumerate(pieces, 1):
        begun = time.monotonic()
        with one_thread(), running():  # a piece is the same wherever it runs: it isn't cut short
            result = work(*piece)
        left = (len(pieces) - done) * (time.monotonic() - begun)
        yield result
        if stop.is_set():
            return
        if workers > 1 and left > (MIN_LEFT if done > 1 else MIN_LEFT_AT_FIRST):
            break
    rest = pieces[done:]
    tasks = (delayed(work)(*piece) for piece in takewhile(lambda _: not stop.is_set(), rest))
    if rest:
        with parallel_config(backend="loky", inner_max_num_threads=1):
            yield from Parallel(n_jobs=min(workers, len(rest)), return_as="generator")(tasks)


def _on_cluster(
    work: Callable[..., Any], pieces: Sequence[Piece], stop: Event, scheduler: str
) -> Iterator[Any]:
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtraError("--scheduler", extra="dask") from None
    try:
        client = Client(scheduler, timeout=CONNECTION_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise OptionError(
            f"no Dask scheduler answers at {scheduler} ({error}); start one with `dask scheduler` and give "
            "the address that it prints",
            option="--scheduler",
            found=scheduler,
        ) from None
    with _quiet(), client:
        _check_workers(client, scheduler)
        futures = [client.submit(work, *piece, pure=False, retries=MAX_RETRIES) for piece in pieces]
        try:
            for future in takewhile(lambda _: not stop.is_set(), futures):
                yield _result(future, scheduler)
        finally:
            if client.status == "running":
                client.cancel(futures)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence Dask's own messages, which fill pages; this module reports errors in one sentence."""
    before = [(handler, handler.level) for handler in logging.getLogger("distributed").handlers]
    try:
        for handler, _ in before:
            handler.setLevel(logging.CRITICAL)
        yield
    finally:
        for handler, level in before:
            handler.setLevel(level)


def _result(future: Any, scheduler: str) -> Any:
    """What a piece gave; each is taken once, however often it was computed."""
    from distributed import CancelledError, KilledWorker

    try:
        return future.result()
    except KilledWorker as error:
        raise OptionError(
            f"a piece of the work ended {error.allowed_failures + 1} workers at {scheduler}, the last at "
            f"{error.last_worker.address}; give them more memory (--memory-limit), or fewer arms"
        ) from None
    except CancelledError:
        raise OptionError(
            f"the connection to the Dask scheduler at {scheduler} was lost, and no results were kept; "
            "restart it and its workers"
        ) from None


def _check_workers(client: Any, scheduler: str) -> None:
    """Refuse a cluster without workers, or with workers whose results could differ from local ones."""
    try:
        client.wait_for_workers(1, timeout=CONNECTION_TIMEOUT)
        theirs = client.run(versions)
    except TimeoutError:
        raise OptionError(
            f"the Dask scheduler at {scheduler} has no workers; start some with `dask worker {scheduler}`"
        ) from None
    except Exception as error:  # a worker without the package can't even say so
        raise OptionError(
            f"the workers at {scheduler} can't import the workbench ({type(error).__name__}); install "
            f"version {package_version()} there"
        ) from None
    ours = versions()
    for address, found in theirs.items():
        if wrong := [
            f"{name} {found[name]} (here {ours[name]})" for name in ours if found[name] != ours[name]
        ]:
            raise OptionError(
                f"the worker at {address} has {', '.join(wrong)}; install the same versions everywhere"
            )


def versions() -> dict[str, str]:
    """The versions that a result depends on."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    libraries = {name: version(name) for name in ("numpy", "scipy", "numba")}
    return {"workbench": package_version(), "Python": python, **libraries}

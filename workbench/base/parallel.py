"""Work in pieces that depend on their arguments alone, by joblib: in this process, on all cores, or on Dask.

Results are the same wherever a piece runs, and come in the order of the pieces; where a worker is lost, Dask
gives its piece to another.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from workbench.base.errors import MissingExtraError, OptionError
from workbench.base.installed_package import NAME
from workbench.base.progress import check_cancelled, progress

CONNECTION_TIMEOUT = 5.0
"""Seconds to wait for a scheduler, and for its first worker."""
MIN_PIECES = 50
"""Other processes of this machine take seconds to begin: fewer pieces are done in this one."""


def spread(
    work: Callable[..., Any],
    pieces: Sequence[tuple[Any, ...]],
    *,
    scheduler: str | None = None,
    text: str = "",
) -> list[Any]:
    """Results of the work on each piece.

    Args:
        work: A function that other processes can import.
        pieces: Its arguments.
        scheduler: Address of a Dask scheduler, such as `tcp://host:8786`; this machine's cores if None, if
            there is much to do.
        text: What is being done, to be shown with the share of the pieces done.

    Raises:
        Cancelled: asked to stop.
    """
    from joblib import Parallel, delayed, parallel_config  # no page needs it to begin with

    workers = 1 if scheduler is None and len(pieces) < MIN_PIECES else -1
    results: list[Any] = []
    with _backend(scheduler) as backend, parallel_config(**backend):
        for result in Parallel(n_jobs=workers, return_as="generator")(
            delayed(work)(*piece) for piece in pieces
        ):
            results.append(result)
            progress(len(results) / len(pieces), text)
            check_cancelled()
    return results


@contextmanager
def _backend(scheduler: str | None) -> Iterator[dict[str, Any]]:
    """Joblib's backend while it is used; what goes wrong with a cluster is one sentence."""
    if scheduler is None:
        yield {"backend": "loky", "inner_max_num_threads": 1}
        return
    try:
        from distributed import CancelledError, Client, KilledWorker
    except ImportError:
        raise MissingExtraError("--scheduler", extra="dask") from None
    try:
        with Client(scheduler, timeout=CONNECTION_TIMEOUT, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=CONNECTION_TIMEOUT)
            client.get_versions(check=True, packages=[NAME, "numpy", "scipy", "numba"])
            yield {"backend": "dask", "client": client}
    except (OSError, ValueError, ImportError, CancelledError, KilledWorker) as error:
        why = str(error).partition("\n")[0]
        raise OptionError(
            f"the Dask cluster at {scheduler} can't be used ({why}): start a scheduler (dask scheduler), and "
            "workers (dask worker) with the same versions as here and enough memory",
            option="--scheduler",
            found=scheduler,
        ) from None

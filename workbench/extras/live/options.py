"""Where samples come from: the option of `serve`."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, final

from workbench.base.errors import OptionError
from workbench.cli.option_records import AbstractCompanion
from workbench.cli.options import option

if TYPE_CHECKING:
    from workbench.session.view import AbstractView
    from workbench.session.worker import Worker


@final
@dataclass(frozen=True)
class LiveOption(AbstractCompanion):
    """A live source that tells where a real arm stands."""

    source: Annotated[
        str | None, option("Follow and measure a real arm: HOST:PORT of its live source, or listen:PORT.")
    ] = None

    @contextmanager
    def opened(self) -> "Iterator[Callable[[Worker], AbstractView | None]]":
        from workbench.extras.live.sources import LiveSource, end_former

        if self.source is None:
            yield end_former
            return
        name = self.source
        with lines_of(name) as lines:
            yield lambda worker: LiveSource(worker, lines, name=name)


@contextmanager
def lines_of(source: str) -> Iterator[Iterable[str]]:
    """Lines of a live source: standard input, an address to connect to, or a port to listen on."""
    from workbench.extras.live.connection import connect, listen

    if source == "-":
        if sys.stdin.isatty():
            raise OptionError("nothing is piped in; give --source HOST:PORT, or pipe a source in")
        yield sys.stdin
    elif source.startswith("listen:"):
        address = source.removeprefix("listen:")
        with listen(address, ready=waiting) as lines:
            yield lines
    else:
        with connect(source) as lines:
            yield lines


def waiting(port: int) -> None:
    """Tell at which port a source or a receiver is waited for."""
    sys.stderr.write(f"waiting at port {port}\n")
    sys.stderr.flush()

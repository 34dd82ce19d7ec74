"""The option of serve that connects to a source."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, final

from workbench.cli.option_records import AbstractCompanion
from workbench.cli.options import option

if TYPE_CHECKING:
    from workbench.session.view import AbstractView
    from workbench.session.worker import Worker


@final
@dataclass(frozen=True)
class LiveOption(AbstractCompanion):
    """A live source that tells where a real arm stands."""

    source: Annotated[str | None, option("Follow and measure a real arm: HOST:PORT of its live source.")] = (
        None
    )

    @contextmanager
    def opened(self) -> "Iterator[Callable[[Worker], AbstractView | None]]":
        from workbench.extras.live.connection import connect
        from workbench.extras.live.sources import LiveSource, end_former

        if self.source is None:
            yield end_former
            return
        name = self.source
        with connect(name) as lines:
            yield lambda worker: LiveSource(worker, lines, name=name)

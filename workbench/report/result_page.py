"""Pages of results, and their figures, that extras draw."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.base.errors import OptionError
from workbench.parts import parts

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class AbstractResultPage(ABC):
    """The page of one kind of result."""

    name: str
    """Of the result's class."""

    @abstractmethod
    def write(self, result: Any, folder: Path | str, *, wanted: Any = None) -> Path:
        """Write the page, its pictures and its numbers into a folder; all of them or nothing.

        Args:
            folder: Made if it is not there; an older page in it is replaced, other files stay.
            wanted: What every pose has to keep; nothing is judged if None.
        """

    @abstractmethod
    def figure(self, result: Any, name: str = "") -> "Figure":
        """One of its figures; the most telling one without a name."""


def page_of(kind: str) -> AbstractResultPage:
    """The page of this kind of result, by its class's name."""
    found = next((page for page in parts("result_pages", AbstractResultPage) if page.name == kind), None)
    if found is None:
        raise OptionError(f"no installed package draws pages of an {kind}")
    return found


def page_figure(self: Any, name: str = "") -> "Figure":
    """A figure of the result: one of its page's by its name."""
    return page_of(type(self).__name__).figure(self, name)

"""Which parts of a session are drawn on the page and in recordings."""

from collections.abc import Iterator

from workbench.parts import parts, warn_of_broken
from workbench.session.state import Session
from workbench.views.drawables.arms import arms, blame, branches
from workbench.views.drawables.measured import measured, selected_row_mark
from workbench.views.drawables.plate import plate
from workbench.views.drawables.region import grid, region
from workbench.views.drawables.sink import Item

SUBJECTS = (arms, blame, plate, region, measured)
"""What page and recordings show; each yields its items for a session."""
ON_PAGE = (grid, branches, selected_row_mark)
"""What the page alone shows besides."""


def items(session: Session, *, on_page: bool) -> Iterator[Item]:
    """Everything that the page, or a recording, shows."""
    for subject in (*SUBJECTS, *parts("drawables"), *(ON_PAGE if on_page else ())):
        try:
            for item in subject(session):
                if not isinstance(item, Item) or not isinstance(item.inputs, tuple):
                    raise TypeError(f"it must yield an Item whose inputs are a tuple, got {item!r}")
                yield item
        except Exception as error:  # whatever is wrong with somebody else's package
            warn_of_broken(f"the drawable {subject.__name__}", error)

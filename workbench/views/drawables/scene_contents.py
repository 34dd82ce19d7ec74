"""Which parts of a session are drawn on the page and in recordings."""

from collections.abc import Iterator

from workbench.parts import warn_of_broken
from workbench.session.state import Session
from workbench.views.drawables.arms import arms, blame, branches
from workbench.views.drawables.measured import measured, selected_row_mark
from workbench.views.drawables.plate import grid, plate, region
from workbench.views.drawables.sink import Item

SUBJECTS = (arms, blame, plate, region, measured)
"""What page and recordings show; each yields its items for a session."""
ON_PAGE = (grid, branches, selected_row_mark)
"""What the page alone shows besides."""


def items(session: Session, *, on_page: bool) -> Iterator[Item]:
    """Everything that the page, or a recording, shows."""
    for subject in (*SUBJECTS, *(ON_PAGE if on_page else ())):
        try:
            yield from subject(session)
        except Exception as error:  # the rest is shown
            warn_of_broken(f"the drawable {subject.__name__}", error)

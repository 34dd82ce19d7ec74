"""Which parts of a session are drawn on the page, in recordings, and during a trajectory."""

from collections.abc import Callable, Iterable, Iterator

from workbench.base.registry import Registry, warn_of_broken
from workbench.session.state import Session
from workbench.views.drawables.arms import arms, blame, branches, deflected_arm
from workbench.views.drawables.events import happened
from workbench.views.drawables.measured import measured, selected_row_marks
from workbench.views.drawables.plate import plate, plate_before
from workbench.views.drawables.region import envelope, region
from workbench.views.drawables.sink import Item

SUBJECTS: Registry[Callable[[Session], Iterator[Item]]] = Registry(
    "drawable", None, arms, plate, region, measured, happened, group="workbench.drawables"
)
"""What page and recordings show; each yields its items for a session."""
ON_PAGE: Registry[Callable[[Session], Iterator[Item]]] = Registry(
    "drawable of the page",
    None,
    plate_before,
    envelope,
    branches,
    selected_row_marks,
    group="workbench.page_drawables",
)
"""What the page alone shows besides."""
MOVING: Registry[Callable[[Session], Iterator[Item]]] = Registry(
    "moving drawable", None, deflected_arm, blame, group="workbench.moving_drawables"
)
"""The same, and what moves with the arm while a trajectory is played."""


def on_page(session: Session) -> Iterator[Item]:
    """Everything that the page shows."""
    yield from _items((*SUBJECTS.values(), *ON_PAGE.values(), *MOVING.values()), session)


def in_recordings(session: Session) -> Iterator[Item]:
    """What recordings show."""
    yield from _items(SUBJECTS.values(), session)


def in_motion(session: Session) -> Iterator[Item]:
    """What moves while a trajectory is played."""
    yield from _items((arms, *MOVING.values()), session)


def _items(subjects: Iterable[Callable[[Session], Iterator[Item]]], session: Session) -> Iterator[Item]:
    for subject in subjects:
        try:
            for item in subject(session):
                if not isinstance(item, Item) or not isinstance(item.inputs, tuple):
                    raise TypeError(f"it must yield an Item whose inputs are a tuple, got {item!r}")
                yield item
        except Exception as error:  # whatever is wrong with somebody else's package
            warn_of_broken(f"the drawable {subject.__name__}", error)

"""Which parts of a session are drawn on the page, in recordings, and during a trajectory."""

from collections.abc import Iterator

from workbench.session.state import Session
from workbench.views.drawables.arms import arms, bent_arm, blame, branches
from workbench.views.drawables.camera import cameras, ellipsoid
from workbench.views.drawables.measured import measured, selected_row_marks
from workbench.views.drawables.plate import plate, plate_before
from workbench.views.drawables.region import envelope, region
from workbench.views.drawables.sink import Item
from workbench.views.drawables.trajectory import arm_on_trajectory, track

SUBJECTS = (arms, plate, region, measured, track, cameras)
"""What page and recordings show."""


def on_page(session: Session) -> Iterator[Item]:
    """Everything that the page shows."""
    for subject in (
        *SUBJECTS,
        plate_before,
        envelope,
        branches,
        selected_row_marks,
        bent_arm,
        blame,
        arm_on_trajectory,
        ellipsoid,
    ):
        yield from subject(session)


def in_motion(session: Session) -> Iterator[Item]:
    """What moves while a trajectory is played."""
    for subject in (arms, bent_arm, blame, arm_on_trajectory):
        yield from subject(session)

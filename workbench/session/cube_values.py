"""Values shown by the cubes of the region: of the chosen field, in the layer and range that are kept."""

import numpy as np
from jaxtyping import Bool

from workbench.session.cube_fields import CHANGE, CUBE_FIELDS, PREDICTED, AbstractCubeField, CubeValues
from workbench.session.state import NO_FIELD, CubeView, Focus, Session


def field_of(session: Session) -> AbstractCubeField | None:
    """The chosen field; None if the cubes are not shown."""
    return CUBE_FIELDS.get(session.region.view.field)


def values(session: Session) -> CubeValues | None:
    """Numbers of the chosen field; None where there are none (yet)."""
    field = field_of(session)
    return None if field is None else field.values(session)


def drawn_field(session: Session) -> AbstractCubeField | None:
    """What the cubes are coloured by: while a target is dragged, how its move changes the predicted error."""
    field = field_of(session)
    return CHANGE if field is PREDICTED and session.drag is not None else field


def inputs(session: Session) -> tuple[object, ...]:
    """Records of the session that the colours depend on, beside region, view and drag."""
    field = field_of(session)
    return (session.region.cubes, *(() if field is None else field.inputs(session)))


def are_shown(session: Session) -> bool:
    """Whether the scene has cubes; nobody asked for those that are there at first."""
    view = session.region.view
    return view.field != NO_FIELD and (view.is_chosen or session.playback.focus is Focus.TARGET)


def shown_cubes(session: Session, view: CubeView, numbers: CubeValues) -> Bool[np.ndarray, " cubes"]:
    """Which cubes are shown: in the kept layer, and within the kept part of the scale."""
    shares, field = numbers.shares, CUBE_FIELDS.get(view.field)
    keep = np.isnan(shares) | ((shares >= view.low) & (shares <= view.high))
    if (field is not None and not field.is_mapped) or view.low > 0.0 or view.high < 1.0:
        keep &= ~np.isnan(shares)
    if view.cut is not None:
        keep &= np.indices(session.plate.region.shape)[view.cut].ravel() == shown_layer(session)
    return keep


def shown_layer(session: Session) -> int:
    """Which layer across the cut is shown: the chosen one, or the middle one."""
    view, shape = session.region.view, session.plate.region.shape
    layers = shape[view.cut or 0]
    return min(view.layer, layers - 1) if view.is_chosen else layers // 2

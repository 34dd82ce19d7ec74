"""Places and angles on the page: three numbers in the units that the page shows, SI inside."""

from enum import StrEnum
from typing import final

import numpy as np
import viser
from jaxtyping import Float

from workbench.session.state import Session, Units
from workbench.views.page.panels.form import DEGREE, AbstractControl, Shown
from workbench.views.page.viser_internals import set_value


class Measure(StrEnum):
    """What three numbers are."""

    LENGTH = "length"
    ANGLE = "angle"


NAMES = {
    (Units.MILLIMETRES, Measure.LENGTH): "mm",
    (Units.MILLIMETRES, Measure.ANGLE): "°",
    (Units.METRES, Measure.LENGTH): "m",
    (Units.METRES, Measure.ANGLE): "rad",
}
SIZES = {"mm": 1e-3, "°": DEGREE, "m": 1.0, "rad": 1.0}
"""Units in SI."""
PLACES = {"mm": 2, "°": 3, "m": 5, "rad": 5}
"""Decimal places that are shown."""
ARROW_KEY_STEPS = {"mm": 1.0, "°": 1.0, "m": 1e-3, "rad": 1e-2}
"""What an arrow key adds."""


@final
class Coordinates(AbstractControl):
    """A control with three numbers; its title has no unit."""

    def __init__(
        self,
        gui: viser.GuiApi,
        title: str,
        quantity: Measure,
        shows: Shown,
        *,
        hint: str,
        disabled: Shown | None = None,
    ):
        self._title, self._quantity = title, quantity
        self._unit = NAMES[Units.MILLIMETRES, quantity]
        self._exact: Float[np.ndarray, "3"] = np.zeros(3)
        made = gui.add_vector3(
            f"{title} [{self._unit}]", (0.0, 0.0, 0.0), step=ARROW_KEY_STEPS[self._unit], hint=hint
        )
        super().__init__(made, disabled=disabled)
        self._shows = shows
        self.control.precision = PLACES[self._unit]  # not that of the step: what is typed stays

    def show_value(self, session: Session) -> None:
        unit = NAMES[session.page.units, self._quantity]
        if unit != self._unit:
            self._unit = unit
            self.control.label = f"{self._title} [{unit}]"
            self.control.step = ARROW_KEY_STEPS[unit]
            self.control.precision = PLACES[unit]
        self._exact = np.array(self._shows(session))
        set_value(self.control, shown(self._exact, self._unit))

    @property
    def typed(self) -> tuple[float, float, float]:
        """What stands there [m or rad]; numbers that were not touched keep all their digits."""
        before = shown(self._exact, self._unit)
        x, y, z = (
            float(old) if new == was else float(SIZES[self._unit] * new)
            for new, was, old in zip(self.control.value, before, self._exact, strict=True)
        )
        return x, y, z


def shown(exact: Float[np.ndarray, "3"], unit: str) -> tuple[float, ...]:
    """Numbers in a unit, rounded as they are shown."""
    return tuple((np.round(exact / SIZES[unit], PLACES[unit]) + 0.0).tolist())

"""The search for a better plate, its place, what is required of it, and the instrument of its errors."""

import numpy as np
import viser

from workbench.session.commands.edit import MovePlate
from workbench.session.commands.identify import SetWanted
from workbench.session.commands.plate import AbstractPlateTrial, ImprovePlate, SetNoise
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.appearance.colours import rounded
from workbench.views.page.html import number
from workbench.views.page.panels.form import ANGLE, DEGREE, LENGTH, AbstractControls
from workbench.views.page.panels.panel import AbstractPanel, ask


class ImprovePanel(AbstractPanel):
    """The one button that makes the plate better."""

    tab, order = Tab.PLATE, 40
    depends = ("is_idle",)

    def build(self, gui: viser.GuiApi) -> None:
        self.button(
            ImprovePlate.title,
            lambda: ImprovePlate(seed=len(self._worker.session.history.past)),
            viser.Icon.SPARKLES,
            "Optimise all unlocked targets, and the plate's place while it is not good enough, for the "
            "lowest predicted error in the region. Cancel stops it, Undo restores the old plate.",
            main=True,
            disabled=lambda s: s.page.job is not None,
        )


class PlacePanel(AbstractPanel):
    """Where the plate is."""

    tab, order = Tab.PLATE, 35
    depends = ("plate", "drag")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Place of the plate", expand_by_default=False):
            hint = "Centre of the plate's top in the base frame; all targets go with it."
            xyz = self.coordinates("x, y, z", LENGTH, hint, lambda s: s.plate.xyz)
            hint = "Roll, pitch and yaw of the plate: turned about x, then y, then z of the base."
            rpy = self.coordinates("Angles", ANGLE, hint, lambda s: s.plate.rpy)
        self.form(MovePlate, xyz, rpy)


class NoisePanel(AbstractPanel):
    """Two numbers."""

    tab, order = Tab.PLATE, 90
    depends = ("noise",)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Instrument", expand_by_default=False):
            limits, hint = (0.001, 10.0, 0.001), "Standard deviation of each measured coordinate."
            position = self.number("Noise [mm]", limits, hint, lambda s: s.noise.position, unit=1e-3)
            limits, hint = (0.001, 5.0, 0.001), "Standard deviation about each axis."
            rotation = self.number("Noise [°]", limits, hint, lambda s: s.noise.rotation, unit=DEGREE)
        self.form(SetNoise, position, rotation)


REQUIRED = "Required [mm]", "Maximum position error allowed for the calibrated arm; 0: no requirement."


def build_wanted(panel: AbstractControls) -> None:
    """Fields for the required error, in every panel that uses it."""

    def wanted(position: float, rotation: float) -> SetWanted:
        before = panel.session.choices.wanted
        return SetWanted(position or None, rotation or None, before is not None and before.per_axis)

    (label, hint), limits = REQUIRED, (0.0, 1000.0, 0.01)
    length = panel.number(label, limits, hint, lambda s: _wanted(s)[0], unit=1e-3, digits=3)
    hint = "Maximum orientation error allowed; 0: no requirement."
    angle = panel.number("Required [°]", limits, hint, lambda s: _wanted(s)[1], unit=DEGREE, digits=3)
    panel.form(wanted, length, angle)


def _wanted(session: Session) -> tuple[float, float]:
    """The required errors [m, rad]; 0 for none."""
    wanted = session.choices.wanted
    return (0.0, 0.0) if wanted is None else (wanted.position, wanted.rotation or 0.0)


TIMES = 3.0
"""Required error that is offered where none is set, as a multiple of the predicted one, then rounded up."""
LIMITS = 0.001, 1000.0
"""Required errors that can be typed there [mm]."""


def try_plate(event: viser.GuiEvent, worker: Worker, trial: AbstractPlateTrial) -> None:
    """Try the plate; ask first what the arms have to keep, if that is not known."""
    session = worker.session
    if session.choices.wanted is not None:
        worker.submit(trial)
        return
    predicted = 1e3 * session.score.position
    minimum, maximum = LIMITS
    offered = (
        min(max(rounded(TIMES * predicted, up=True), minimum), maximum) if np.isfinite(predicted) else 1.0
    )
    fields: list[viser.GuiNumberHandle] = []

    def build(gui: viser.GuiApi) -> None:
        label, hint = REQUIRED
        fields.append(gui.add_number(label, offered, min=minimum, max=maximum, step=0.001, hint=hint))

    def begin() -> None:
        worker.submit(SetWanted(1e-3 * float(fields[0].value)))
        worker.submit(trial)

    known = f" {number(predicted)} mm rms are predicted." if np.isfinite(predicted) else ""
    question = f"How accurate must every arm be, everywhere in the region?{known}"
    ask(event, "Required error", question, "Try with this", begin, build=build)

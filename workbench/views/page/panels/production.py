"""The yield of the current plate: the share of virtual arms that meet the requirement."""

import numpy as np
import viser

from workbench.plate.report.design import yield_sentence
from workbench.session.commands.plate import MOST_ARMS, SetNoise, TryPlate
from workbench.session.export import fixture_zip
from workbench.session.state import Session, Tab
from workbench.views.page.html import MUTED, block, heading, text
from workbench.views.page.panels.panel import AbstractPanel, set_value


class ProductionPanel(AbstractPanel):
    """A number of arms, a button, and one sentence."""

    tab, order = Tab.PLATE, 50
    depends = ("is_idle", "trial", "tried")

    def build(self, gui: viser.GuiApi) -> None:
        self._try = self.button(
            "Try this plate",
            lambda: TryPlate(int(self._arms.value)),
            viser.Icon.CHART_BAR,
            "Calibrate virtual arms with random manufacturing errors on it: the share that meets the "
            "required error everywhere in the region, and which error source dominates. Takes about a "
            "minute; Cancel stops it.",
        )
        self._result = gui.add_html("", visible=False)
        self._arms = self.number(
            "Virtual arms",
            TryPlate.arms,
            (1, MOST_ARMS, 1),
            "Number of arms to try. More arms give a narrower interval and take longer.",
        )
        self.download(
            "Plate to make (ZIP)",
            fixture_zip,
            "Solids, drawings and lists of everything that the plate is made of. Takes a few seconds.",
        )

    def show(self, session: Session) -> None:
        self._try.disabled = session.job is not None
        self._result.visible = session.trial is not None
        self._result.content = result(session)


def result(session: Session) -> str:
    """The last yield in words, if there is one."""
    trial = session.trial
    if trial is None:
        return ""
    content = heading("Yield") + f"<div>{text(yield_sentence(trial.found))}.</div>"
    if session.tried is None:
        words = "The plate, the instrument or the wanted error has changed since; try again."
        content += f'<div style="color:{MUTED}">{words}</div>'
    return block(content, testid="yield", style="margin:4px 0")


class NoisePanel(AbstractPanel):
    """Two numbers."""

    tab, order = Tab.PLATE, 90
    depends = ("noise",)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Instrument", expand_by_default=False):
            self._position = self.number(
                "Noise [mm]", 0.1, (0.001, 10.0, 0.001), "Standard deviation of each measured coordinate."
            )
            self._rotation = self.number(
                "Noise [°]",
                0.02,
                (0.001, 5.0, 0.001),
                "Standard deviation of the measured rotation about each axis.",
            )
        for field in (self._position, self._rotation):
            self.sends(field, self._noise)

    def show(self, session: Session) -> None:
        set_value(self._position, round(1e3 * session.noise.position, 6))
        set_value(self._rotation, round(float(np.rad2deg(session.noise.rotation)), 6))

    def _noise(self) -> SetNoise:
        return SetNoise(1e-3 * float(self._position.value), float(np.deg2rad(self._rotation.value)))

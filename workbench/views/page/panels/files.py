"""Saving the session's data and results, with the error of each file of the calibrated arm."""

import numpy as np
import viser

from workbench.arm.urdf import BASE_LINK
from workbench.base.wording import capital
from workbench.data.accuracy_requirement import Wanted
from workbench.exports import FORMS, AbstractForm
from workbench.identification.errors.row_errors import Errors
from workbench.identification.run import file_notes, judging_text, sizes
from workbench.report.numbers import compared
from workbench.session import export
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import BAD, GOOD, MUTED, block, bullets, folded, heading, text
from workbench.views.page.panels.panel import AbstractPanel

PARTS = "STL, the targets, joint positions to measure them with; STEP, drawings where [cad] is installed."
FORMATS = (
    "TOML is for this program, with all effects; URDF for others, geometry alone; the report is a web page."
)
OTHER_FORMS = "Those of 'export --for' that suit an arm of so many joints."
OTHER = "Its difference from the calibrated arm, and what it can't hold, are shown when it is saved."
ROOT = f"a URDF's root '{BASE_LINK}' is the instrument's frame: mount the arm by the link below it"
SAVED = {"URDF": export.calibrated_urdf, "TOML": export.calibrated_toml, "Report": export.report_zip}


def _errors(session: Session) -> str:
    """A line for each format, with its error, whether it keeps the required one, and what it holds."""
    found, run, wanted = session.results.identification, session.results.run, session.choices.wanted
    if found is None or run is None or found.identifiability.refused:
        return ""
    added, errors = run.saved.robot.effects, sizes(run.file_errors)
    holds = {
        "URDF": "geometry alone; the TOML holds the effects too" if added else "for other programs",
        "TOML": "with all effects" if added else "for workbench",
    }
    lines = (
        f'<div><b>{text(errors[name])}</b> <span style="color:{MUTED}">'
        f"{_range(run.file_errors[name])}{what}</span>{_verdict(run.file_errors[name], wanted)}</div>"
        for name, what in holds.items()
        if name in errors
    )
    notes = folded("About these files", bullets(text(capital(note)) for note in (*file_notes(run), ROOT)))
    content = heading(f"Mean error of each file on {judging_text(run)}") + "".join(lines) + notes
    return block(content, testid="file-errors", style="margin:2px 0 6px")


def _range(errors: Errors) -> str:
    """How far the mean error of so few rows may be from that of many; nothing where they have no length."""
    known = 1e3 * errors.position[np.isfinite(errors.position)]
    if len(known) < 2:
        return ""
    return f"± {compared(2.0 * known.std(ddof=1) / np.sqrt(len(known)), 2)} mm with other rows held out; "


def _verdict(errors: Errors, wanted: Wanted | None) -> str:
    """Whether the worst row keeps the required error; nothing where its length alone doesn't tell."""
    if wanted is None or not np.isfinite(errors.position_mm.max):
        return ""
    worst, angle = errors.position_mm.max, errors.orientation_deg and errors.orientation_deg.max
    is_kept = wanted.within_by_norms(1e-3 * worst, np.nan if angle is None else np.deg2rad(angle))
    if not is_kept and wanted.per_axis and 1e-3 * worst <= np.sqrt(3.0) * wanted.position:
        return ""
    shown = f"{worst:.3g} mm" + (f" and {angle:.2g}°" if wanted.rotation and angle is not None else "")
    colour, mark = (GOOD, "✓ at most") if is_kept else (BAD, "✗ up to")
    return f'<div style="color:{colour}">{mark} {shown}; required: {text(wanted.text)}</div>'


def _forms(session: Session) -> dict[str, AbstractForm]:
    """Those that an arm of so many joints has, by their titles."""
    new = (form for form in FORMS.values() if not form.needs_source)
    return {capital(form.title): form for form in new if not form.dofs or session.robot.dof in form.dofs}


class FilesPanel(AbstractPanel):
    """The calibrated arm once there is one, with the error of each file, and plate and measurements."""

    tab, order = Tab.EXPORT, 10
    depends = ("robot", "measurements", "results", "choices.wanted")

    def build(self, gui: viser.GuiApi) -> None:
        with self.folder("Calibrated arm", visible=lambda s: s.results.identification is not None):
            self.html(_errors)
            save = lambda event: self.save(event, SAVED[event.target.value])  # noqa: E731
            self.press_one("Save", SAVED, save, FORMATS)
            form = self.dropdown("Other format", _forms, OTHER_FORMS)
            save_in = lambda event: self.save(event, export.exported_as(form.typed), is_arm=True)  # noqa: E731
            self.press("Save in this format", save_in, viser.Icon.DOWNLOAD, OTHER)
        with gui.add_folder("Plate and measurements"):
            self.download("Plate to make (ZIP)", export.fixture_zip, PARTS)
            self.download("Plate (TOML)", export.plate_toml, "The plate with its targets and its region.")
            self.download(
                "Measurements (CSV)",
                export.measurements_csv,
                "One row per line, with units.",
                disabled=lambda s: s.measurements.loaded is None,
            )

"""Measurements: from a file, or from a virtual arm; how each column of a file was read, and a choice to
correct it, after which the file is read again."""

import json

import viser

from workbench.arm.joint_units import sliding
from workbench.base.units import EXAMPLES, Quantity, parse_heading
from workbench.data.observation import known_columns
from workbench.data.readers.column_meanings import TableColumn
from workbench.data.readers.columns_option import GROUPS, IGNORED, NamedUnit
from workbench.data.readers.headings import quantities_of
from workbench.data.readers.read import Preview
from workbench.data.simulation.simulate import LIKELY_ERRORS
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_html
from workbench.session.commands.data import (
    MAX_FILE_BYTES,
    ForgetData,
    LoadData,
    MeasureVirtualArm,
    load_command,
    load_endings,
)
from workbench.session.loaded_measurements import Loaded, MeasurementFile
from workbench.session.next_step import next_step
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import BAD, LINE, block, bullets, heading, text
from workbench.views.page.panels.form import on_change
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel

MORE = 60
"""Poses besides the targets: with these a diagnosis has enough rows."""


class DataPanel(AbstractPanel):
    """Two sources of measurements, and how they were interpreted."""

    tab, order, pause = Tab.MEASURE, 10, AFTERWARDS
    depends = ("measurements.loaded", "measurements.unread", next_step)
    _arms = 0
    """Virtual arms so far, each with other errors."""

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Real arm"):
            self.upload(
                "Load measurements",
                load_command,
                "Joint positions and measured poses: a CSV, Excel or Parquet file, units in "
                f"brackets as in q1[deg] or x[mm]; up to {MAX_FILE_BYTES // 2**20} MiB.",
                endings=",".join(load_endings()),
                maximum=MAX_FILE_BYTES,
                color=lambda s: "gray" if next_step(s).next or s.page.caption or s.page.job else None,
            )
        with gui.add_folder("Virtual arm"):
            self.button(
                "Measure a virtual arm",
                self._virtual,
                viser.Icon.ROBOT,
                "Create an arm with hidden manufacturing errors and one effect beyond geometry, and measure "
                "it at the targets and at more poses.",
            )
        self.html(lambda s: _preview(s.measurements.loaded, s.measurements.unread))
        self.button(
            "Remove these measurements",
            ForgetData,
            viser.Icon.TRASH,
            "Remove the measurements and everything identified from them.",
            visible=lambda s: s.measurements.loaded is not None,
        )

    def _virtual(self) -> MeasureVirtualArm:
        self._arms += 1
        turning = [k for k, slides in enumerate(sliding(self._worker.session.robot), 1) if not slides]
        hidden = tuple(f"joint-harmonic:{k}:3e-3" for k in turning[self._arms % max(len(turning), 1) :][:1])
        return MeasureVirtualArm(self._arms, MORE, LIKELY_ERRORS, hidden)


def _preview(loaded: Loaded | None, unread: MeasurementFile | None) -> str:
    """What is loaded, below the name of a file that was refused since."""
    if loaded is None:
        return ""  # the strip says it
    notes, refused = bullets(map(text, loaded.notes)), ""
    if unread is not None:
        refused = f'<div style="color:{BAD}">{text(unread.name)} was not read. What was loaded stays:</div>'
    return block(
        f'{refused}<div style="font-weight:600;overflow-wrap:anywhere">{text(loaded.name)}</div>'
        + as_html([ResultTable("", (), loaded.facts, words=2)])
        + (heading("Notes on reading") + notes if notes else ""),
        testid="preview",
        style=f"margin:8px 0;padding-top:8px;border-top:1px solid {LINE}",
    )


MAX_LISTED_COLUMNS = 80
"""Columns that are listed."""


class ColumnsPanel(AbstractPanel):
    """A folder that is there, and open, with a file."""

    tab, order = Tab.MEASURE, 20
    depends = (lambda session: file_of(session), "robot")
    _shown: MeasurementFile | None = None

    def build(self, gui: viser.GuiApi) -> None:
        with self.folder("Columns of the file", visible=file_of):
            names, hint = lambda s: _headings(s) or ("-",), "The file's heading."
            self._column = self.dropdown("Column", names, hint, self._heading, visible=_headings)
            hint = "Meaning of the column; a change reads the file again. - ignores the column."
            meaning = self.dropdown("is", self._meanings, hint, self._understood, visible=_headings)
            on_change(self._column, lambda _: meaning.show(self._worker.session))
            self.form(self._choose, meaning)
            self.html(lambda s: "" if (file := file_of(s)) is None else listing(file, s.measurements.loaded))

    def _heading(self, session: Session) -> str:
        """The chosen one; of another file the first that is left out or lacks its unit, or else the first."""
        before, self._shown = self._shown, (file := file_of(session))
        if file is None or file is before:
            return self._column.typed
        named = [c for c in file.preview.columns if c.heading]
        doubts = [c for c in named if lacks_unit(c)] + [c for c in named if c.key is None]
        return (doubts or named)[0].heading

    def _meanings(self, session: Session) -> list[str]:
        names = list(meanings(session.robot.dof))
        return names if (now := self._understood(session)) in names else [now, *names]

    def _understood(self, session: Session) -> str:
        """How the chosen column is understood."""
        file = file_of(session)
        columns = () if file is None else file.preview.columns
        return next((ours(c) for c in columns if c.heading == self._column.typed), "-")

    def _choose(self, meaning: str) -> LoadData | None:
        session = self._worker.session
        if (file := file_of(session)) is None or meaning == self._understood(session):
            return None
        columns = with_column(understood_as(file.preview), self._column.typed, meaning)
        return LoadData(file.name, file.content, json.dumps(columns, ensure_ascii=False))


def file_of(session: Session) -> MeasurementFile | None:
    """The file whose columns are in question: one that was refused for them, or else the loaded one."""
    loaded, unread = session.measurements.loaded, session.measurements.unread
    if unread is not None and unread.preview.columns and (loaded is None or unread.match is None):
        return unread
    return None if loaded is None else loaded.file


def _headings(session: Session) -> list[str]:
    """Those of a plain file."""
    file = file_of(session)
    return [c.heading for c in file.preview.columns if c.heading] if file and file.is_plain else []


def listing(file: MeasurementFile, loaded: Loaded | None) -> str:
    """Columns with their first cell and what they are read as; problems above. Rows that are loaded have told
    the units that their headings lack."""
    found = file.preview
    problems = f"<b>{text(file.name)}</b>"
    told = (sentence.removeprefix(f"{file.name}: ") for sentence in found.problems)
    problems += "".join(f'<div style="color:{BAD}">{text(sentence)}</div>' for sentence in told)
    lacking = "unit?" if loaded is None or loaded.file is not file else "unit told by the rows"
    rows = []
    for c in found.columns:
        said = "left out" if c.key is None else ours(c) + f": {lacking}" * lacks_unit(c)
        rows.append((c.heading or "(none)", "".join(c.cells[:1])[:10], said))
    kept = slice(None, None, 1 if any(first for _, first, _ in rows) else 2)  # a layout keeps no cells
    shown = [row[kept] for row in rows[:MAX_LISTED_COLUMNS]]
    listed = as_html([ResultTable("", ("heading", "first", "is")[kept], shown, words=3)])
    return block(f"{problems}{listed}", testid="columns")


def understood_as(preview: Preview) -> dict[str, str]:
    """Each heading with its meaning."""
    return {c.heading: ours(c) for c in preview.columns if c.heading}


def ours(column: TableColumn) -> str:
    return IGNORED if column.key is None else NamedUnit(column.key, column.unit).heading()


def lacks_unit(column: TableColumn) -> bool:
    """Whether a column is a quantity whose unit nobody said."""
    quantities = () if column.key is None else quantities_of(column.key)
    return column.unit is None and any(q is not Quantity.NUMBER for q in quantities)


def with_column(columns: dict[str, str], heading: str, is_now: str) -> dict[str, str]:
    """The same with one column something else.

    What had been that is left out, and columns of its kind that lack a unit have the same one.

    Args:
        columns: Meanings by heading.
        heading: The file's.
        is_now: Ours with its unit, or "-".
    """
    columns = {**columns}
    name, unit = parse_heading(is_now)
    for other, was in columns.items() if name != IGNORED else ():
        key, known = parse_heading(was)
        if key == name:
            columns[other] = IGNORED
        elif unit and known is None and key != IGNORED and quantities_of(key) == quantities_of(name):
            columns[other] = f"{key}[{unit}]"
    return {**columns, heading: is_now}


def meanings(joints: int) -> tuple[str, ...]:
    """What a column may be, with every usual unit, as a mapping says it: "-" first, which leaves it out."""
    keys = [f"q{k + 1}" for k in range(joints)]
    keys += [key for group in ("xyz", "rpy", "rotvec", "quat", "matrix") for key in GROUPS[group]]
    keys += [name for c in known_columns().values() if c.kept for name in c.names(joints)]
    keys += ["sigma_x", "sigma_y", "sigma_z", *(f"distance{k}" for k in range(1, 7))]
    found = [IGNORED]
    for key in keys:
        known = [q for q in quantities_of(key) if q is not Quantity.NUMBER]
        found += [f"{key}[{unit}]" for q in known for unit in EXAMPLES[q].split(" or ")] or [key]
    return tuple(found)

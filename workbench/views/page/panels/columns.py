"""How each column of a file was read, and a choice to correct it, after which the file is read again."""

import viser

from workbench.base.wording import plural
from workbench.data.readers.mapping import lacks_unit, mapping_text, meanings, ours, with_column
from workbench.data.readers.preview import PreviewColumn
from workbench.session.commands.data import LoadData
from workbench.session.commands.messages import Tell
from workbench.session.export import columns_toml
from workbench.session.loaded_measurements import MeasurementFile
from workbench.session.state import Session, Tab
from workbench.views.page.html import BAD, MUTED, block, table, text
from workbench.views.page.panels.form import on_change, show_options
from workbench.views.page.panels.panel import AbstractPanel, set_value

MAX_LISTED_COLUMNS = 80
"""Columns that are listed."""
MAX_MAPPING_BYTES = 2**16
"""Mappings beyond this size are refused [bytes]."""


class ColumnsPanel(AbstractPanel):
    """A folder that is there, and open, with a file."""

    tab, order = Tab.MEASURE, 20
    depends = (lambda session: file_of(session), "robot")
    _shown: MeasurementFile | None = None

    def build(self, gui: viser.GuiApi) -> None:
        self._folder = gui.add_folder("Columns of the file", visible=False)
        with self._folder:
            self._column = gui.add_dropdown("Column", ("-",), hint="The file's heading.")
            self._is = gui.add_dropdown(
                "is",
                ("-",),
                hint="Meaning of the column; a change reads the file again. - ignores the column.",
            )
            on_change(self._column, lambda: self._show_meaning(file_of(self._worker.session)))
            self.sends(self._is, self._choose)
            self.download(
                "Save this choice (TOML)",
                columns_toml,
                "The meaning of every column, for other files of this kind.",
            )
            self.upload(
                "Use a saved choice",
                self._with_mapping,
                "Reads the file again with the saved meaning of its columns.",
                endings=".toml",
                maximum=MAX_MAPPING_BYTES,
            )
            self._list = gui.add_html("")

    def show(self, session: Session) -> None:
        file = file_of(session)
        self._folder.visible = file is not None
        if file is None:
            return
        headings = [c.heading for c in file.preview.columns if c.heading]
        plain = file.preview.layout == "plain" and bool(headings)
        self._column.visible = self._is.visible = plain
        self._list.content = listing(file)
        if plain:
            is_same = file is self._shown and self._column.value in headings
            show_options(self._column, headings)
            set_value(self._column, self._column.value if is_same else _first_doubtful(file))
            self._show_meaning(file)
        self._shown = file

    def _show_meaning(self, file: MeasurementFile | None) -> None:
        """The dropdown as the chosen column is understood."""
        if file is None:
            return
        is_now = _understood(file, self._column.value)
        options = list(meanings(self._worker.session.robot.dof))
        show_options(self._is, options if is_now in options else [is_now, *options])
        set_value(self._is, is_now)

    def _choose(self) -> LoadData | None:
        file = file_of(self._worker.session)
        if file is None or self._is.value == _understood(file, self._column.value):
            return None
        mapping = with_column(mapping_text(file.preview), self._column.value, self._is.value)
        return LoadData(file.name, file.content, mapping.encode())

    def _with_mapping(self, name: str, content: bytes) -> LoadData | Tell:
        file = file_of(self._worker.session)
        return Tell("load measurements first") if file is None else LoadData(file.name, file.content, content)


def file_of(session: Session) -> MeasurementFile | None:
    """The file whose columns are in question."""
    if session.measurements.unread is not None:
        return session.measurements.unread
    return None if session.measurements.loaded is None else session.measurements.loaded.file


def listing(file: MeasurementFile) -> str:
    """Columns with their first cell and what they are read as; problems above."""
    found = file.preview
    problems = "".join(f'<div style="color:{BAD}">{text(sentence)}</div>' for sentence in found.problems)
    rows = [(text(c.heading or "(none)"), text(c.first[:10]), _meaning(c)) for c in found.columns]
    more = len(rows) - MAX_LISTED_COLUMNS
    rest = f'<div style="color:{MUTED}">{plural(more, "more column")}</div>' if more > 0 else ""
    return block(
        problems + table(("heading", "first", "is"), rows[:MAX_LISTED_COLUMNS]) + rest, testid="columns"
    )


def _meaning(column: PreviewColumn) -> str:
    if column.key is None:
        return f'<span style="color:{MUTED}">left out</span>'
    meaning = text(ours(column))
    return f'<span style="color:{BAD}">{meaning}: unit?</span>' if lacks_unit(column) else meaning


def _understood(file: MeasurementFile, heading: str) -> str:
    return next((ours(c) for c in file.preview.columns if c.heading == heading), "-")


def _first_doubtful(file: MeasurementFile) -> str:
    """The heading of the first column that is left out or lacks its unit; of the first one if none is."""
    named = [c for c in file.preview.columns if c.heading]
    doubts = [c for c in named if lacks_unit(c)] + [c for c in named if c.key is None]
    return (doubts or named)[0].heading

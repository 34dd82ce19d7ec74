"""Fixtures for files of binary formats: each is read in a child; the same bytes in one test, in one."""

import io
import zipfile

import openpyxl
import pytest

from workbench.base.bounded_process import ChildError
from workbench.base.errors import FileError
from workbench.data import binary_tables
from workbench.data.readers import preview, read_measurements


def zipped(*files: tuple) -> bytes:
    """An archive of files by their names."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files:
            archive.writestr(name, content)
    return out.getvalue()


def refusal(path, error=FileError, **options):
    """The error that reading raises; the preview must list the same sentence instead, of no file another."""
    with pytest.raises(error) as caught:
        read_measurements(path, **options)
    said, problems = str(caught.value), preview(path, **options).problems
    assert problems == (said,) if error is FileError else said in problems
    assert "\n" not in said
    assert len(said) <= 300
    return caught.value


@pytest.fixture(autouse=True)
def read_once(monkeypatch):
    """What a child answered, kept for as long as a test: many read a file and preview it as well."""
    read, known = binary_tables.in_child, {}

    def once(function, content, *, seconds, memory, **others):
        key = function, content, seconds, memory
        if key not in known:
            try:
                known[key] = read(function, content, seconds=seconds, memory=memory, **others)
            except ChildError as error:
                known[key] = error
        if isinstance(known[key], ChildError):
            raise known[key]
        return known[key]

    monkeypatch.setattr(binary_tables, "in_child", once)


@pytest.fixture
def read_here(monkeypatch):
    """Without a child, which costs more to start than any sound file to read."""
    monkeypatch.setattr(binary_tables, "in_child", lambda function, content, **_: function(content))


def workbook(sheets):
    """The bytes of a workbook with rows of cells by the names of its sheets."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()

"""Self-contained HTML pages: no network, no scripts, embedded pictures.

All have one head and one look (`page.html`) and share their tables, cards and figures (`parts.html`).
Everything that is written into a page passes through the template's escaping; only our own pictures are put
in as they are.
"""

from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup

from workbench.base.files import write_folder
from workbench.base.wording import readable
from workbench.report.figures import COLOURS, DrawnFigure
from workbench.report.json import Json, json_text
from workbench.report.numbers import short, signed, standard_error


@cache
def page_template(name: str, *, package: str = "workbench.report") -> Template:
    """A template of a page, of a package or among the general ones; everything put in is escaped."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(p) for p in dict.fromkeys((package, "workbench.report"))]),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=lambda value: type(value)(readable(value)) if isinstance(value, str) else value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"short": short, "signed": signed, "plusminus": standard_error}
    environment.filters["themed"] = lambda drawing: Markup(themed(drawing.svg))
    return environment.get_template(name)


def themed(svg: str) -> str:
    """The picture with colours that the page may brighten on a dark ground."""
    for number, colour in enumerate(COLOURS):
        svg = svg.replace(colour, f"var(--figure-{number}, {colour})")
    return svg


def write_page(
    folder: Path | str,
    page: str,
    drawings: Sequence[DrawnFigure],
    result: Json,
    *,
    replaces: Iterable[str] = (),
    numbers: str = "result.json",
    package: str = "workbench.report",
    files: dict[str, bytes] | None = None,
    **fields: Any,
) -> Path:
    """Write a page, its pictures as SVG files and its numbers: all of them or nothing.

    An older page in the folder is replaced; other files in it stay.

    Args:
        folder: Made if it is not there.
        page: Name of the page and of its template.
        drawings: Its pictures.
        result: Its numbers.
        replaces: Names of files of an older page that go, even if nothing new has their name.
        numbers: Name of the file for these.
        package: Where its template is, if not among the general ones.
        files: Further files with their contents; None: the pictures.
        **fields: What the template is filled with.

    Returns:
        Path of the page.
    """
    if files is None:
        files = {f"{drawing.name}.svg": drawing.svg.encode() for drawing in drawings}
    text = page_template(page, package=package).render(drawings=drawings, **fields)
    files = files | {numbers: json_text(result).encode(), page: text.encode()}
    return write_folder(folder, files, replaces=replaces) / page

"""A result as one self-contained HTML page: no network, no scripts, its blocks as the terminal and notebooks
show them, with charts; and its numbers beside it. All text is escaped."""

from collections.abc import Iterable
from pathlib import Path

from markupsafe import Markup

from workbench.base.files import write_folder
from workbench.base.wording import readable
from workbench.report.blocks import Block
from workbench.report.json import Json, json_text
from workbench.report.result_display import as_html

PAGE = Markup("""<!DOCTYPE html>
<html lang="en-GB">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<style>
{look}
</style>
</head>
<body><main><header><p class="kind">{kind}</p><h1>{title}</h1></header>
{content}
</main></body>
</html>
""")
LOOK = Path(__file__).with_name("look.css")


def write_page(
    folder: Path | str,
    names: tuple[str, str],
    blocks: Iterable[Block],
    result: Json,
    *,
    title: str,
    kind: str,
) -> Path:
    """Write a page and its numbers into a folder: both or nothing; other files in it stay.

    Args:
        folder: Made if it is not there.
        names: Of the page and of the JSON file.
        blocks: What the page shows, in order.
        result: The numbers.
        title: Whose result it is.
        kind: Of result.

    Returns:
        Path of the page.
    """
    look, title = Markup(LOOK.read_text("utf-8")), readable(title)
    page = PAGE.format(title=title, kind=kind, look=look, content=Markup(as_html(blocks)))
    files = {names[1]: json_text(result).encode(), names[0]: page.encode()}
    return write_folder(folder, files) / names[0]

"""A result as one self-contained HTML page: no network, no scripts, pictures embedded.

The page shows what the terminal does: the same tables, then charts. All text is escaped; only our own
pictures are put in as they are.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup
from rich.console import RenderableType

from workbench.base.files import write_folder
from workbench.base.wording import readable
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


class PageBlock(NamedTuple):
    """One part of a page.

    Args:
        title: Its heading; empty for none.
        shown: Tables and lines.
        picture: An SVG; empty for none.
        caption: What the picture shows.
    """

    title: str = ""
    shown: RenderableType | None = None
    picture: str = ""
    caption: str = ""

    def html(self) -> Markup:
        parts = [Markup("<h2>{}</h2>").format(self.title)] if self.title else []
        if self.shown is not None:
            parts.append(Markup('<div class="scroll">{}</div>').format(Markup(as_html(self.shown))))
        if self.picture:
            drawn = Markup("<figure>{}<figcaption>{}</figcaption></figure>")
            parts.append(drawn.format(Markup(self.picture), self.caption))
        return Markup("\n").join(parts)


def write_page(
    folder: Path | str,
    names: tuple[str, str],
    blocks: Iterable[PageBlock],
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
    content = Markup("\n").join(block.html() for block in blocks)
    title = readable(title)
    page = PAGE.format(title=title, kind=kind, look=Markup(LOOK.read_text("utf-8")), content=content)
    files = {names[1]: json_text(result).encode(), names[0]: page.encode()}
    return write_folder(folder, files) / names[0]

"""Pages that need nothing else: no network, no scripts, their pictures inside.

Everything that is written into a page passes through the template's escaping; only our own pictures are put
in as they are.
"""

from functools import cache

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, Template

from workbench.report.figures import COLOURS
from workbench.report.numbers import short, signed, standard_error


@cache
def page_template(name: str, *, package: str = "workbench.report") -> Template:
    """A template of a page, of a package or among the general ones; everything put in is escaped."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(p) for p in dict.fromkeys((package, "workbench.report"))]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"short": short, "signed": signed, "plusminus": standard_error}
    return environment.get_template(name)


def themed(svg: str) -> str:
    """The picture with colours that the page may brighten on a dark ground."""
    for number, colour in enumerate(COLOURS):
        svg = svg.replace(colour, f"var(--figure-{number}, {colour})")
    return svg

"""The drawing set: a page each for the plate, every shape of block, the probe, and what ties the plate down.

Each page says everything that a machinist needs: views, dimensions from datums, a table of holes, position
and angle tolerances from the plate's own budget, surfaces and material. The lists hold the same numbers.
"""

from workbench.plate.parts.block_page import block_page
from workbench.plate.parts.drawing import Page
from workbench.plate.parts.page_parts import sheet
from workbench.plate.parts.parts import Fixture, Slab
from workbench.plate.parts.slab_page import slab_page
from workbench.plate.parts.turned_page import turned_page


def pages_of(fixture: Fixture) -> tuple[Page, ...]:
    """All pages in order, the plate first."""
    drawn = [slab_page(fixture, fixture.slab)]
    drawn += [block_page(fixture, shape) for shape in fixture.shapes]
    drawn += [
        slab_page(fixture, part) if isinstance(part, Slab) else turned_page(fixture, part)
        for part in fixture.others
    ]
    return tuple(
        Page(
            name=page.name,
            paper=page.paper,
            scale=page.scale,
            items=(*page.items, *sheet(page, number, len(drawn))),
        )
        for number, page in enumerate(drawn, start=1)
    )

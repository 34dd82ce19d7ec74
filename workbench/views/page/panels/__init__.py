"""The panels of the page; each says its tab and its place in it itself."""

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from workbench.parts import parts
from workbench.views.page.panels.panel import AbstractPanel


@cache
def own_panels() -> tuple[type[AbstractPanel], ...]:
    """Those of this folder that name a tab; the others stand beside the tabs."""
    for module in iter_modules(__path__):
        import_module(f"{__name__}.{module.name}")
    kinds = (kind for kind in AbstractPanel.__subclasses__() if kind.__module__.startswith(__name__))
    return tuple(kind for kind in kinds if "order" in vars(kind))


def panels() -> tuple[type[AbstractPanel], ...]:
    """All panels: ours, and those of extras and other packages."""
    return own_panels() + parts("panels", AbstractPanel, classes=True)

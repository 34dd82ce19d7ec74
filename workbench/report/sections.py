"""Sections that other packages add to the pages of results."""

import json
from abc import ABC, abstractmethod
from functools import partial
from typing import Any

from workbench.base.advice import ask
from workbench.base.registry import Registry
from workbench.report.json import Json


class AbstractSection(ABC):
    """A section near the end of a result's page, such as that of an `Identification`."""

    name: str
    title: str

    @abstractmethod
    def html(self, result: Any) -> str:
        """What stands below the title: text, or `Markup`; empty for a result that it doesn't concern."""

    def json(self, result: Any) -> Json:
        """What the page's file of numbers says under `name`; nothing by default."""
        return {}


SECTIONS: Registry[AbstractSection] = Registry("section", AbstractSection, group="workbench.report_sections")


def sections_of(result: Any) -> tuple[list[tuple[str, str]], Json]:
    """Titles with what stands below them, and numbers by name; one that fails is a warning on the page."""
    shown, found = list[tuple[str, str]](), Json()
    for name, section in SECTIONS.items():
        below, numbers = ask(f"the section '{name}'", partial(_both, section, result), ("", {}))
        shown += [(section.title, below)] if below else []
        found |= {name: numbers} if numbers else {}
    return shown, found


def _both(section: AbstractSection, result: Any) -> tuple[str, Json]:
    numbers = section.json(result)
    json.dumps(numbers)  # else the whole file could not be written
    return section.html(result), numbers

"""Somebody who sees the page for the first time: clicks that are counted."""

from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Page

from workbench.views.page.app import App

DRAWN = "() => (window.__viserTestpoints?.rendererInfo?.render?.triangles ?? 0) > 3000"
LONG = 120_000
"""How long anything may take [ms]."""


@dataclass(eq=False)
class Visit:
    """A page of an app that asks what one has; counts what its user does."""

    page: Page
    app: App
    clicks: int = 0

    @classmethod
    def open(cls, page: Page, app: App) -> "Visit":
        page.goto(f"{app.url}/?fixedDpr=1")
        page.wait_for_function(DRAWN, timeout=LONG)
        return cls(page, app)

    def press(self, label: str) -> None:
        """A button that has to be in view without scrolling."""
        button = self.page.get_by_role("button", name=label, exact=True).first
        button.wait_for(timeout=LONG)
        top = button.bounding_box()["y"]
        assert 0 <= top < self.page.viewport_size["height"] - 10, f"'{label}' is out of view"
        button.click(timeout=LONG)
        self.clicks += 1

    def drop(self, which: int, path: Path) -> None:
        """A file on a button of the card, which is no click."""
        self.page.locator(".mantine-Modal-body input[type=file]").nth(which).set_input_files(path)

    def says(self, text: str, testid: str = "hint") -> str:
        """Wait until the page says so; returns all that it says there."""
        place = self.page.locator(f'[data-testid="{testid}"]', has_text=text).first
        place.wait_for(timeout=LONG)
        return place.inner_text()

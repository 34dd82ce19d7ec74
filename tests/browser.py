"""A running app, and a real headless Chromium that looks at it."""

import itertools
import math
import os
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import viser
import viser.transforms as vtf
from playwright.sync_api import Browser, FilePayload, Page, expect, sync_playwright

from workbench import load_plate, load_robot
from workbench.session import Session
from workbench.session.command import AbstractChange
from workbench.views.page.app import App
from workbench.views.page.render import FIRST

PROGRAMS = ("chromium-headless-shell", "chromium")
"""Debian's Chromium without a window, and the whole one, whose window nobody sees: twice as costly."""
FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=gl-egl",
    "--ignore-gpu-blocklist",
    "--disable-gpu-rasterization",
]
JAGGED = ["--webgl-antialiasing-mode=none", "--webgl-msaa-sample-count=0"]
"""Half the work of drawing the scene without a graphics card."""
DRAWN = "() => (window.__viserTestpoints?.rendererInfo?.render?.triangles ?? 0) > 3000"
PANEL = """document.querySelector('[data-testid="hint"]').closest('.mantine-ScrollArea-viewport')"""
SIZE = {"width": 1280, "height": 800}
PICTURED = bool(os.environ.get("WORKBENCH_PICTURES"))
SHARPNESS = 1 if PICTURED else 0.25
"""Pixels that are drawn for one of the page's; nobody looks at it where no pictures are kept."""
UNCOVERED = """() => document.head.appendChild(document.createElement('style')).textContent =
  '.mantine-Notification-root { pointer-events: none !important; opacity: 0 }'"""
"""viser's note about software rendering lies above the scene; the page's own messages are elsewhere."""
SIGNS = itertools.count()
expect.set_options(timeout=60_000)


class StartAgain(AbstractChange):
    """Back to a session in which nothing has happened."""

    title = "Start again"

    first: Session

    def apply(self, session: Session) -> Session:
        now = session.page
        page = replace(self.first.page, revision=now.revision, message_count=now.message_count)
        return replace(self.first, page=page)


@pytest.fixture(scope="session")
def running() -> Iterator[App]:
    app = App(load_robot("aria"), load_plate("table2"))
    yield app
    app.close()


@pytest.fixture(scope="session")
def untouched(running: App) -> Session:
    running.worker.wait()
    return running.worker.session


@pytest.fixture
def app(running: App, untouched: Session) -> Iterator[App]:
    """The app of this worker, in whose session nothing has happened yet; no panel may raise in the test."""
    running.worker.cancel()
    running.worker.wait()
    running.worker.submit(StartAgain(untouched))
    running.worker.wait()
    running.view._tabs._opened = FIRST  # not the tab that an earlier test made the program open last
    yield running
    assert running.view._failed == set()


def browser_program() -> str | None:
    """The first of `PROGRAMS` that is installed."""
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    if (program := browser_program()) is None:
        reason = f"none of Debian's {' and '.join(PROGRAMS)} is installed"
        if os.environ.get("CI", "").lower() == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    with sync_playwright() as playwright:
        flags = FLAGS if PICTURED else FLAGS + JAGGED
        browser = playwright.chromium.launch(executable_path=program, headless=True, args=flags)
        yield browser
        browser.close()


@dataclass(eq=False)
class Screen:
    """A page and what a user does on it."""

    page: Page
    app: App
    client: viser.ClientHandle
    errors: list[str]

    @classmethod
    def open(cls, app: App, chromium: Browser) -> "Screen":
        """A page of a user of its own."""
        context = chromium.new_context(viewport=SIZE, device_scale_factor=SHARPNESS, accept_downloads=True)
        context.set_default_timeout(60_000)
        page = context.new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
        known = set(app.server.get_clients())
        page.goto(f"{app.url}/?fixedDpr={SHARPNESS}")
        return cls(page, app, cls._drawn(page, app, known), errors)

    @staticmethod
    def _drawn(page: Page, app: App, known: set[int]) -> viser.ClientHandle:
        """What the server has to do with the page, once the page is drawn."""
        page.wait_for_selector('[data-testid="index"]')
        page.wait_for_function(DRAWN)
        page.evaluate(UNCOVERED)
        return next(c for i, c in app.server.get_clients().items() if i not in known)

    def reload(self) -> None:
        """As a user does it."""
        known = set(self.app.server.get_clients())
        self.page.reload()
        self.client = self._drawn(self.page, self.app, known)

    def close(self) -> None:
        self.page.context.close()

    def show(self, session: Session) -> None:
        """Go on with another session."""
        self.app.worker.submit(StartAgain(session))
        self.app.worker.wait()

    def settle(self) -> None:
        """Wait until the page shows all that the server has sent to pages by now."""
        sign = f"settled-{next(SIGNS)}"
        shown = self.app.server.gui.add_html(f'<i data-testid="{sign}"></i>')
        self.app.server.flush()
        self.page.wait_for_selector(f'[data-testid="{sign}"]', state="attached")
        shown.remove()

    def text(self, testid: str) -> str:
        self.settle()
        return self.page.locator(f'[data-testid="{testid}"]').inner_text()

    def box(self, testid: str, inside: str = "") -> dict[str, float]:
        """Where something is on the page; asked at once, as what shows numbers is made anew with them."""
        found = self.page.wait_for_function(
            "css => document.querySelector(css)?.getBoundingClientRect().toJSON()",
            arg=f'[data-testid="{testid}"] {inside}',
        )
        return found.json_value()

    def tab(self, name: str) -> None:
        tab = self.page.get_by_role("tab", name=name)
        self.settle()
        self.page.wait_for_function("!window.wanted")  # what was done last brings its own tab to the front
        tab.click()
        expect(tab).to_have_attribute("aria-selected", "true")

    def to_top(self) -> None:
        """Scroll the panel to its top, once the page no longer puts it where this tab was left."""
        self.page.evaluate(f"requestAnimationFrame(() => requestAnimationFrame(() => {PANEL}.scrollTop = 0))")
        self.page.wait_for_function(f"{PANEL}.scrollTop === 0")

    def press(self, name: str) -> None:
        """A button of this name; where the strip offers it too, that one. It no longer moves by then."""
        self.settle()
        self.page.get_by_role("button", name=name, exact=True).first.click()

    def give(self, button: str, file: Path | FilePayload) -> None:
        """Press a button that asks for a file, and choose this one."""
        with self.page.expect_file_chooser() as chooser:
            self.press(button)
        chooser.value.set_files(file)

    def choose(self, label: str, option: str) -> None:
        """Choose in a drop-down list; it is not made anew meanwhile."""
        self.settle()
        self.page.get_by_label(label, exact=True).click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def wait_text(self, testid: str, wanted: str, timeout: float = 60_000) -> None:
        self.page.wait_for_function(
            '([id, words]) => document.querySelector(`[data-testid="${id}"]`)?.innerText.includes(words)',
            arg=[testid, wanted],
            timeout=timeout,
        )

    def until(self, holds: Callable[[Session], bool], timeout: float = 60.0) -> Session:
        """The session once a gesture has had its effect on it."""
        self.wait(lambda: holds(self.app.worker.session), timeout)
        self.app.worker.wait()
        return self.app.worker.session

    def wait(self, holds: Callable[[], bool], timeout: float = 60.0) -> None:
        """Until something is so that the page has no event for."""
        end = time.monotonic() + timeout
        while not holds():
            assert time.monotonic() < end, "it did not come"
            self.page.wait_for_timeout(50)

    def wait_node(self, name: str, place: np.ndarray, timeout: float = 60_000) -> None:
        """Until the page has a node there, to a hundredth of a millimetre."""
        self.page.wait_for_function(
            "([n, p]) => window.__viserMutable.nodePoseData[n]?.position"
            ".every((v, i) => Math.abs(v - p[i]) < 1e-5)",
            arg=[name, place.tolist()],
            timeout=timeout,
        )

    def node(self, name: str) -> list[float]:
        """Position and orientation of a node as the page has it."""
        self.settle()
        pose = self.page.evaluate("n => window.__viserMutable.nodePoseData[n]", name)
        return [*pose["position"], *pose["wxyz"]]

    def pixel(self, point) -> np.ndarray:
        """Where a point of the world is on the page."""
        camera = self.client.camera
        seen = vtf.SO3(camera.wxyz).inverse().apply(np.asarray(point, float) - camera.position)
        box = self.page.locator("canvas").first.bounding_box()
        focal = 0.5 * box["height"] / math.tan(camera.fov / 2)
        middle = np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])
        return middle + focal * seen[:2] / seen[2]

    def grab(self, axis: int) -> tuple[np.ndarray, np.ndarray]:
        """Take hold of an arrow; returns where, and how far one metre along it is on the page."""
        handle = self.app.view.gizmo.handles["arrows"]
        along = np.eye(3)[axis]
        tip = np.array(handle.position) + 0.9 * handle.scale * along
        at = self.pixel(tip)
        metre = 10.0 * (self.pixel(tip + 0.1 * along) - at)
        self.page.mouse.move(*at)
        self.page.wait_for_timeout(150)
        self.page.mouse.down()
        return at, metre

    def shoot(self, name: str) -> None:
        """Keep a picture, for people."""
        folder = os.environ.get("WORKBENCH_PICTURES")
        if folder:
            Path(folder).mkdir(parents=True, exist_ok=True)
            self.page.screenshot(path=Path(folder) / f"{name}.png")


KEPT = pytest.StashKey[list[Screen]]()


@pytest.fixture(scope="session")
def kept(pytestconfig: pytest.Config) -> list[Screen]:
    """A page of the running app, for the next test."""
    return pytestconfig.stash.setdefault(KEPT, [])


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Closes the kept page behind the last test in a browser: it would be drawn beside all that follow."""
    if nextitem is not None and not ("browser" in nextitem.path.name or "look" in nextitem.fixturenames):
        kept = item.config.stash.get(KEPT, [])
        while kept:
            kept.pop().close()


@pytest.fixture
def look(app: App, chromium: Browser, kept: list[Screen], request) -> Iterator[Callable[[], Screen]]:
    """Opens pages of the app, each as another user; `new` for one on which no other test opened folders."""
    screens: list[Screen] = []
    is_shared = "running" in request.fixturenames

    def open_page(*, new: bool = False) -> Screen:
        while new and kept:
            kept.pop().close()
        screens.append(kept.pop() if is_shared and kept else Screen.open(app, chromium))
        screens[-1].tab("Plate")
        screens[-1].to_top()  # a page that another test left keeps where that test scrolled it to
        screens[-1].settle()
        return screens[-1]

    yield open_page
    if is_shared and not any(screen.errors for screen in screens):
        kept += [screen for screen in screens if not screen.page.is_closed()][:1]
    for screen in screens:
        if screen not in kept:
            screen.close()
        assert not screen.errors

"""Every screen of the page, from one scripted session, to look at oneself.

Run it with a folder:

    python tests/views/page/pictures.py /tmp/pictures

The start card and each step of the story in windows of 390, 900, 1500 and 2560 px, light and dark. README's
own pictures are made by `assets/docs/pictures.py`.
"""

import sys
from dataclasses import replace
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.session.command import AbstractChange, AbstractCommand, kinds
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.identify import Identify
from workbench.session.commands.messages import OpenTab
from workbench.session.page_state import Opened, Tab
from workbench.session.state import Session
from workbench.views.page.app import App

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist"]
SIZES = ((390, 844), (900, 700), (1500, 950), (2560, 1440))
STEPS: tuple[tuple[str, tuple[AbstractCommand, ...]], ...] = (
    ("plate", (OpenTab(Tab.PLATE),)),
    ("identify", (MeasureVirtualArm(5, surprise=True, more=70), Identify(), OpenTab(Tab.CALIBRATE))),
    ("diagnose", (Diagnose(), OpenTab(Tab.CALIBRATE))),
    ("result", (AddEffects(), OpenTab(Tab.CALIBRATE))),
    *((f"tab-{tab}".lower(), (OpenTab(tab),)) for tab in Tab),
    ("measuring", (ChooseRobot("ur5"), kinds()["BeginMeasuring"](), kinds()["DriveArm"]())),
)
"""Name of a picture, and the commands that lead to it."""
DRAWN = "() => (window.__viserTestpoints?.rendererInfo?.render?.triangles ?? 0) > 3000"
NO_NOTES = (
    "() => document.head.appendChild(document.createElement('style')).textContent = "
    "'.mantine-Notification-root { display: none }'"
)
DRAWN_AFTER = 2500
"""How long a page is given after each step [ms]."""


class Show(AbstractChange):
    """Go to a state of the session."""

    title = "Show"

    wanted: Session

    def apply(self, session: Session) -> Session:
        opened = None if self.wanted.page.opened is None else Opened(self.wanted.page.opened.tab)
        return replace(
            self.wanted, page=replace(self.wanted.page, opened=opened, revision=session.page.revision)
        )


def walked(app: App) -> dict[str, Session]:
    """The session at each step."""
    found = {}
    for name, commands in STEPS:
        for command in commands:
            app.worker.submit(command)
            app.worker.wait(300.0)
        found[name] = app.worker.session
    return found


def opened(browser: Browser, app: App, size: tuple[int, int]) -> Page:
    """A page of this size."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    page.goto(f"{app.url}/?fixedDpr=1")
    page.wait_for_function(DRAWN, timeout=120_000)
    page.evaluate(NO_NOTES)
    return page


def shoot(browser: Browser, app: App, states: dict[str, Session], folder: Path) -> None:
    """Pictures of these states of an app."""
    for size in SIZES:
        page = opened(browser, app, size)
        for name, state in states.items():
            for shade, is_dark in (("", False), ("-dark", True)):
                app.worker.submit(
                    Show(replace(state, page=replace(state.page, is_dark=is_dark, is_dark_chosen=True)))
                )
                page.wait_for_timeout(DRAWN_AFTER)
                page.screenshot(path=folder / f"{name}-{size[0]}{shade}.png")
        page.close()


def main(folder: Path) -> None:
    """Make them all."""
    sys.path.append(str(Path(__file__).resolve().parents[2]))
    from browser import browser_program

    folder.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_program(), args=FLAGS)
        for asks in (True, False):
            app = App(load_robot("aria"), load_plate("table2"), asks=asks)
            try:
                shoot(browser, app, {"start": app.worker.session} if asks else walked(app), folder)
            finally:
                app.close()
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))

"""Four stories on the page, by the clicks of somebody who sees it for the first time, with a clock:

    python tests/views/page/stories.py FOLDER [own_robot] [plate] [film] [pictures]

own_robot: a robot and its measurements, both files dropped, to the cause and the calibrated URDF;
plate: an arm of the built-in ones, to a plate that can be made and keeps a wanted error;
film: the demo;
pictures: a ZIP of 30 rendered pictures with joints, camera and board, to the calibrated URDF.

A picture is kept at every step; clicks and seconds are printed.
"""

import shutil
import sys
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from conftest import browser_program
from playwright.sync_api import Page, sync_playwright

from workbench.arm.built_in_arms import load_robot
from workbench.arm.urdf import write_urdf
from workbench.plate.plate_toml import load_plate
from workbench.session.state import Tab
from workbench.views.page.app import App
from workbench.views.page.demo import END

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist"]
DRAWN = "() => (window.__viserTestpoints?.rendererInfo?.render?.triangles ?? 0) > 3000"
LONG = 300_000
"""How long anything may take [ms]."""


@dataclass(eq=False)
class Visit:
    """A page of an app that asks what one has; counts what its user does.

    Args:
        page: Opened and drawn.
        app: What it shows.
        folder: Of the pictures; None: none are kept.
    """

    page: Page
    app: App
    folder: Path | None = None
    clicks: int = 0
    began: float = field(default_factory=time.monotonic)
    pictures: list[Path] = field(default_factory=list)

    @classmethod
    def open(cls, page: Page, app: App, folder: Path | None = None) -> "Visit":
        page.goto(f"{app.url}/?fixedDpr=1")
        page.wait_for_function(DRAWN, timeout=LONG)
        return cls(page, app, folder)

    @property
    def seconds(self) -> float:
        """Since the page was there."""
        return time.monotonic() - self.began

    def press(self, label: str) -> None:
        """A button that has to be in view without scrolling."""
        button = self.page.get_by_role("button", name=label, exact=True).first
        button.wait_for(timeout=LONG)
        top = button.bounding_box()["y"]
        assert 0 <= top < self.page.viewport_size["height"] - 10, f"'{label}' is out of view"
        self.click(button)

    def click(self, what) -> None:
        what.click(timeout=LONG)
        self.clicks += 1

    def type(self, label: str, words: str) -> None:
        """Click a field and type."""
        given = self.page.get_by_label(label, exact=True).first
        self.click(given)
        given.fill(words)
        given.press("Enter")

    def drop(self, which: int, path: Path) -> None:
        """A file on a button of the card, which is no click."""
        self.page.locator(".mantine-Modal-body input[type=file]").nth(which).set_input_files(path)

    def save(self, label: str, path: Path) -> Path:
        """What a button downloads."""
        with self.page.expect_download(timeout=LONG) as download:
            self.press(label)
        download.value.save_as(path)
        return path

    def says(self, words: str, testid: str = "hint") -> str:
        """Wait until the page says so; returns all that it says there."""
        place = self.page.locator(f'[data-testid="{testid}"]', has_text=words).first
        place.wait_for(timeout=LONG)
        return place.inner_text()

    def opened(self, tab: Tab) -> None:
        self.page.wait_for_function(
            "name => document.querySelector('[role=tab][aria-selected=true]')?.innerText === name",
            arg=str(tab),
            timeout=LONG,
        )

    def shoot(self, name: str) -> None:
        """Keep a picture of this step."""
        if self.folder is not None:
            self.page.wait_for_timeout(1000)
            self.pictures.append(self.folder / f"{len(self.pictures):02}-{name}.png")
            self.page.screenshot(path=self.pictures[-1])


def own_robot(visit: Visit, robot: Path, rows: Path, cause: str, folder: Path) -> Path:
    """Robot and measurements to the cause; returns the calibrated URDF."""
    visit.shoot("card")
    visit.press("A robot and measurements")
    visit.drop(0, robot)
    visit.says(f"Robot: {load_robot(robot).name}", "start")
    visit.shoot("robot")
    visit.app.worker.wait()
    visit.drop(1, rows)
    visit.says("rows of")
    visit.opened(Tab.IDENTIFY)
    assert visit.page.locator('[data-testid="start"]').count() == 0
    visit.shoot("rows")
    visit.press("Identify the geometry")
    visit.says("something is not geometry")
    visit.shoot("identified")
    visit.press("Find the cause")
    visit.says(cause)
    visit.opened(Tab.DIAGNOSE)
    visit.shoot("cause")
    visit.press("Add what was found")
    visit.says(" → ")
    visit.opened(Tab.IDENTIFY)
    visit.shoot("added")
    return visit.save("URDF", folder / "calibrated.urdf")


def plate(visit: Visit, robot: str, wanted: str, folder: Path) -> Path:
    """An arm to a plate that can be made; returns its archive."""
    visit.press("Only a robot")
    visit.click(visit.page.locator(".mantine-Modal-body").get_by_label("Built in", exact=True))
    visit.click(visit.page.get_by_role("option", name=robot, exact=True))
    visit.says(f"Robot: {load_robot(robot).name}", "start")
    visit.shoot("robot")
    visit.press("Design a plate for it")
    visit.says("Good enough?")
    visit.shoot("plate")
    visit.press("Improve the plate")
    visit.says(" mm at first. Good enough?")
    visit.shoot("improved")
    visit.type("Wanted [mm]", wanted)
    visit.says("not yet tried against the wanted")
    visit.shoot("wanted")
    visit.press("Try it on virtual arms")
    visit.says("Make the plate, then measure")
    visit.shoot("tried")
    return visit.save("Plate to make (ZIP)", folder / "plate.zip")


def film(visit: Visit) -> None:
    """The demo from its beginning to its end."""
    visit.press("Nothing yet: show me")
    told, end = "", time.monotonic() + LONG / 1e3
    while END[:40] not in told:
        assert time.monotonic() < end
        session = visit.app.worker.session
        words = session.caption or (session.messages[-1].text if session.messages else "")
        if words != told:
            told = words
            visit.shoot(f"{visit.seconds:.0f}s")
        visit.page.wait_for_timeout(200)


def pictures(visit: Visit, archive: Path, folder: Path) -> Path:
    """Pictures of a board in an archive to the joints that moved; returns the calibrated URDF."""
    visit.click(visit.page.get_by_role("tab", name="Measure", exact=True))
    with visit.page.expect_file_chooser(timeout=LONG) as chooser:
        visit.press("… or an archive of it (ZIP)")
    chooser.value.set_files(archive)
    visit.page.get_by_text("30 pictures read from").first.wait_for(timeout=LONG)
    visit.shoot("read")
    visit.press("Identify the geometry")
    visit.opened(Tab.IDENTIFY)
    visit.app.worker.wait()
    visit.shoot("identified")
    return visit.save("URDF", folder / "calibrated.urdf")


def tell(story: str, folder: Path) -> None:
    """One story in a browser of its own, its pictures in the folder."""
    sys.path.append(str(Path(__file__).resolve().parents[2]))
    from board_on_tool import photograph
    from driven_effects import driven_file

    folder.mkdir(parents=True, exist_ok=True)
    app = App(load_robot("aria"), load_plate("table2"), asks=story != "pictures")
    try:
        with sync_playwright() as playwright, tempfile.TemporaryDirectory() as made:
            archive = Path(made) / "shots.zip"
            if story == "pictures":
                shots = Path(made) / "shots"
                shots.mkdir()
                photograph(app.worker.session.robot, np.deg2rad([0, 0, 0.6, 0, -0.4, 0]), shots, count=30)
                shutil.make_archive(str(archive.with_suffix("")), "zip", made, "shots")
            browser = playwright.chromium.launch(executable_path=browser_program(), args=FLAGS)
            page = browser.new_page(viewport={"width": 1280, "height": 800}, accept_downloads=True)
            visit = Visit.open(page, app, folder)
            if story == "own_robot":
                robot = write_urdf(replace(load_robot("aria"), name="own"), Path(made) / "own.urdf")
                rows, cause = driven_file("payload", Path(made))
                own_robot(visit, robot, rows, cause, folder)
            elif story == "plate":
                plate(visit, "ur5", "0.5", folder)
            elif story == "pictures":
                pictures(visit, archive, folder)
            else:
                film(visit)
            print(f"{story}: {visit.clicks} clicks, {visit.seconds:.0f} s; {folder}")
            browser.close()
    finally:
        app.close()


if __name__ == "__main__":
    for _story in sys.argv[2:] or ("own_robot", "plate", "film"):
        tell(_story, Path(sys.argv[1]) / _story)

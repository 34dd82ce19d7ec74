"""Stories on the page, by the clicks of somebody who sees it for the first time, with a clock:

    python tests/stories.py FOLDER [own_robot] [plate] [film] [pictures]

own_robot: a robot and its measurements, both files dropped, to the cause and the calibrated URDF;
plate: a robot's file, to a plate that can be made;
film: the demo;
pictures: a ZIP of 30 rendered pictures with joints, to the calibrated URDF.

No file is written by the package. A picture is kept at every step; clicks and seconds are printed.
"""

import shutil
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from generator import VirtualArm
from playwright.sync_api import Page, sync_playwright
from scipy.spatial.transform import Rotation

from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.session.page_state import Tab
from workbench.views.page.app import App
from workbench.views.page.demo import END

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist"]
DRAWN = "() => (window.__viserTestpoints?.rendererInfo?.render?.triangles ?? 0) > 3000"
LONG = 120_000
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

    def type(self, label: str, text: str) -> None:
        """Click a field and type."""
        given = self.page.get_by_label(label, exact=True).filter(visible=True).first
        self.click(given)
        given.fill(text)
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

    def says(self, text: str, testid: str = "hint") -> str:
        """Wait until the page says so; returns all that it says there."""
        place = self.page.locator(f'[data-testid="{testid}"]', has_text=text).first
        place.wait_for(timeout=LONG)
        return place.inner_text()

    def idle(self) -> None:
        """Wait until what was asked for is done, and shown."""
        self.page.wait_for_timeout(300)
        assert self.app.worker.wait(LONG / 1e3)
        self.page.wait_for_timeout(300)

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


def own_files(folder: Path) -> tuple[Path, Path]:
    """A URDF and a CSV of an arm that is off by a millimetre and gives way at its second joint."""
    rng, turn = np.random.default_rng(11), np.pi / 2
    chain = np.array(
        [
            (0.0, 0.152, 0.0, turn, 0.0),
            (0.0, 0.0, -0.41, 0.0, 0.0),
            (0.0, 0.0, -0.37, 0.0, 0.0),
            (0.0, 0.115, 0.0, turn, 0.0),
            (0.0, 0.09, 0.0, -turn, 0.0),
            (0.0, 0.085, 0.0, 0.0, 0.0),
        ]
    )
    limits = np.tile([-2.0 * np.pi, 2.0 * np.pi], (6, 1))
    masses, coms = np.array([9.0, 8.0, 5.0, 3.0, 2.0, 1.0]), np.zeros((6, 3))
    nominal = VirtualArm("dh", chain, limits=limits, masses=masses, coms=coms)
    actual = nominal.perturbed(rng, length=1e-3, angle=np.deg2rad(0.3))
    q = 0.4 * nominal.random(rng, 120)
    soft = np.zeros((6, 3))
    soft[1, 2] = 6e-5
    p, r = actual.measure(q, rng, 2e-5, 1e-4, actual.sag(q, compliance=soft))
    heads = [*(f"q{k}[deg]" for k in range(1, 7)), "x[mm]", "y[mm]", "z[mm]", "qw", "qx", "qy", "qz"]
    wxyz = Rotation.from_matrix(r).as_quat()[:, [3, 0, 1, 2]]
    rows = np.hstack([np.rad2deg(q), 1e3 * p, wxyz])
    paths = folder / "own.urdf", folder / "measured.csv"
    paths[0].write_text(_urdf(nominal))
    paths[1].write_text("\n".join([",".join(heads), *(",".join(f"{v:.9g}" for v in row) for row in rows)]))
    return paths


INERTIA = '<inertia ixx="1e-2" ixy="0" ixz="0" iyy="1e-2" iyz="0" izz="1e-2"/>'


def _urdf(arm: VirtualArm) -> str:
    """The arm's URDF: before each joint what follows the joint before it."""
    lines, tail = ['<robot name="own">', '<link name="base"/>'], (0.0, 0.0, 0.0)
    ends = [*zip(arm.table.tolist(), arm.limits.tolist(), arm.masses.tolist(), strict=True), None]
    for k, end in enumerate(ends, start=1):
        a, d, alpha = tail
        name, kind = (f"link{k}", "revolute") if end else ("flange", "fixed")
        before = f"link{k - 1}" if k > 1 else "base"
        mass = f'<inertial><mass value="{end[2]}"/>{INERTIA}</inertial>' if end else ""
        lines += [
            f'<link name="{name}">{mass}</link>',
            f'<joint name="joint{k}" type="{kind}"><parent link="{before}"/><child link="{name}"/>',
            f'<origin xyz="{a} 0 {d}" rpy="{alpha} 0 0"/><axis xyz="0 0 1"/>',
        ]
        if end:
            (_, d, a, alpha, _), (low, high) = end[:2]
            tail = a, d, alpha
            lines.append(f'<limit lower="{low}" upper="{high}" effort="0" velocity="0"/>')
        lines.append("</joint>")
    return "\n".join([*lines, "</robot>"])


def own_robot(visit: Visit, robot: Path, rows: Path, folder: Path) -> Path:
    """Robot and measurements to the cause; returns the calibrated URDF."""
    visit.shoot("card")
    visit.press("A robot and measurements")
    visit.drop(0, robot)
    visit.says("Robot: own", "start")
    visit.shoot("robot")
    visit.app.worker.wait()
    visit.drop(1, rows)
    visit.says("rows of")
    visit.opened(Tab.CALIBRATE)
    assert visit.page.locator('[data-testid="start"]').count() == 0
    visit.shoot("rows")
    for label in ("Identify the geometry", "Find the cause", "Add the effects found"):
        visit.press(label)
        visit.idle()
        visit.opened(Tab.CALIBRATE)
        visit.shoot(label.split()[0].lower())
    return visit.save("URDF", folder / "calibrated.urdf")


def plate(visit: Visit, robot: Path, folder: Path) -> Path:
    """A robot's file to a plate that can be made; returns its archive."""
    visit.press("Only a robot: design a plate")
    visit.drop(0, robot)
    visit.says("Robot: own", "start")
    visit.shoot("robot")
    visit.press("Design a plate for it")
    visit.idle()
    visit.shoot("plate")
    visit.press("Try this plate")
    visit.shoot("asked")
    visit.press("Try with this")
    visit.idle()
    visit.shoot("tried")
    return visit.save("Plate to make (ZIP)", folder / "plate.zip")


def film(visit: Visit) -> None:
    """The demo from its beginning to its end."""
    visit.press("Nothing yet: show me")
    warnings, end = "", time.monotonic() + LONG / 1e3
    while END[:40] not in warnings:
        assert time.monotonic() < end
        session = visit.app.worker.session
        message = session.page.caption or (session.page.messages[-1].text if session.page.messages else "")
        if message != warnings:
            warnings = message
            visit.shoot(f"{visit.seconds:.0f}s")
        visit.page.wait_for_timeout(200)


def pictures(visit: Visit, archive: Path, folder: Path) -> Path:
    """Pictures of a board that no file describes, to the joints that moved; returns the calibrated URDF."""
    visit.press("Pictures of a board")
    visit.type("Square [mm]", "30")
    visit.shoot("asked")
    with visit.page.expect_file_chooser(timeout=LONG) as chooser:
        visit.click(visit.page.locator(".mantine-Modal-body input[accept='.zip']"))
    chooser.value.set_files(archive)
    visit.says("No target.toml", "question")
    visit.shoot("question")
    visit.press("Read with this board")
    visit.page.get_by_text("30 pictures read from").first.wait_for(timeout=LONG)
    visit.shoot("read")
    visit.idle()
    visit.shoot("identified")
    visit.press("Save the arm …")
    return visit.save("URDF", folder / "calibrated.urdf")


def tell(story: str, folder: Path) -> None:
    """One story in a browser of its own, its pictures in the folder."""
    from board_on_tool import photograph
    from browser import browser_program

    folder.mkdir(parents=True, exist_ok=True)
    app = App(load_robot("aria"), load_plate("table2"), asks=True)
    try:
        with sync_playwright() as playwright, tempfile.TemporaryDirectory() as made:
            archive = Path(made) / "shots.zip"
            if story == "pictures":
                shots = Path(made) / "shots"
                shots.mkdir()
                photograph(app.worker.session.robot, np.deg2rad([0, 0, 0.6, 0, -0.4, 0]), shots, count=30)
                for name in ("camera", "target"):
                    (shots / f"{name}.toml").unlink()
                shutil.make_archive(str(archive.with_suffix("")), "zip", made, "shots")
            browser = playwright.chromium.launch(executable_path=browser_program(), args=FLAGS)
            page = browser.new_page(viewport={"width": 1280, "height": 800}, accept_downloads=True)
            visit = Visit.open(page, app, folder)
            robot, rows = own_files(Path(made))
            if story == "own_robot":
                own_robot(visit, robot, rows, folder)
            elif story == "plate":
                plate(visit, robot, folder)
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

"""Pictures of README and documentation: `python assets/docs/pictures.py [tour] [notebook] [drawing]`, or all.

Chromium has to be installed. In `assets/pictures` they make

- tour: `tour.webp` (it moves), `page-design.png`, `identify.png` and `diagnose.png`: the story of `workbench serve --demo` is
  played, and every few commands the page is kept as it stands;
- notebook: `notebook.png`, what an executed notebook shows;
- drawing: `drawing-plate.png`, the drawing of Table 2, optimised.
"""

import html
import io
import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from workbench.arm.built_in_arms import load_robot
from workbench.extras.workshop.drawing import pdf_of, plate_drawing
from workbench.extras.workshop.fixture import fixture_of
from workbench.plate.design import optimise_plate
from workbench.plate.measured_plate import load_plate
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.drag import MoveTarget
from workbench.session.commands.messages import OpenTab, SetCaption
from workbench.views.page.app import App
from workbench.views.page.demo import story

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist"]
DRAWN = "() => (window.__viserTestpoints?.rendererInfo?.render?.triangles ?? 0) > 3000"
CLEAR = """() => document.head.appendChild(document.createElement('style')).textContent =
  '.mantine-Notification-root { display: none }'"""
SIZE = {"width": 1280, "height": 800}
WIDTH = 960
"""Width of the moving picture [px]."""
EVERY, EVERY_ROW = 6, 2
"""Of a drag's places each sixth is kept, of measured rows each second."""
BENT = 3
"""The row, of those shown, at which the film begins: the real arm bent away from the nominal one."""
SETTLED = 400
"""Time that the page is given to draw a step [ms]."""
PICTURES = ROOT / "assets" / "pictures"
NOTEBOOK = ROOT / "tests" / "notebooks" / "identify_and_diagnose.ipynb"
STYLE = """<style>
  body { font: 15px sans-serif; margin: 8px 16px }
  pre { background: #f3f4f6; border-left: 3px solid #1d6fb8; padding: 8px 10px; margin: 14px 0 8px }
  img { max-width: 100% }
</style>"""


def frames(app: App, page: Page) -> Iterator[tuple[Image.Image, int, str]]:
    """The page after every few commands, how long it stands [ms], and what was done last."""

    def kept() -> Image.Image:
        return Image.open(io.BytesIO(page.screenshot())).convert("RGB")

    for scene in story(lambda: app.worker.session):
        moves = rows = 0
        for command in (*([SetCaption(scene.caption)] if scene.caption else []), OpenTab(scene.tab)):
            app.worker.submit(command)
        for command in scene.commands:
            app.worker.submit(command)
            app.worker.wait(600.0)
            moves += isinstance(command, MoveTarget)
            rows += isinstance(command, ShowRow)
            if isinstance(command, MoveTarget) and moves % EVERY:
                continue
            if isinstance(command, ShowRow) and rows % EVERY_ROW:
                continue
            page.wait_for_timeout(SETTLED if moves else 3 * SETTLED)
            alone = len(scene.commands) == 1
            yield kept(), 2500 if alone else 120 if moves else 800, type(command).__name__
        if not scene.commands and scene.caption:
            page.wait_for_timeout(SETTLED)
            yield kept(), 1500, ""


def keep(page: Page, name: str, *, colours: int = 256, whole: bool = False) -> None:
    """A picture of the page, as small as it can be."""
    drawn = Image.open(io.BytesIO(page.screenshot(full_page=whole))).convert("RGB")
    drawn.quantize(colours).save(PICTURES / f"{name}.png", optimize=True)


def tour(browser: Browser) -> None:
    """Play the story and keep the page."""
    app = App(load_robot("aria"), load_plate("table2"))
    page = browser.new_context(viewport=SIZE, color_scheme="light").new_page()
    page.goto(f"{app.url}/?fixedDpr=1")
    page.wait_for_function(DRAWN, timeout=60_000)
    page.evaluate(CLEAR)
    page.wait_for_timeout(3000)
    keep(page, "page-design")
    shown: list[tuple[Image.Image, int]] = []
    rows, bent = 0, None
    for picture, time, last in frames(app, page):
        if last in ("Identify", "Diagnose"):
            app.worker.submit(SetCaption(""))
            app.worker.wait(120.0)
            page.wait_for_timeout(3 * SETTLED)
            keep(page, last.lower())
        size = (WIDTH, WIDTH * picture.height // picture.width)
        shown.append((picture.resize(size, Image.Resampling.LANCZOS), time))
        rows += last == "ShowRow"
        bent = shown[-1][0] if rows == BENT else bent
    app.close()
    shown.insert(0, (bent, 1500))  # what the film is about, in its first second
    pictures, times = zip(*shown, strict=True)
    pictures[0].save(
        PICTURES / "tour.webp",
        save_all=True,
        append_images=pictures[1:],
        duration=list(times),
        loop=0,
        quality=38,
        method=6,
    )


def notebook(browser: Browser) -> None:
    """Code and answers of an executed notebook's fits."""
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    parts = [STYLE]
    for cell in cells:
        answers = [output["data"] for output in cell.get("outputs", []) if len(output.get("data", {})) > 1]
        if answers:
            parts.append(f"<pre>{html.escape(''.join(cell['source']))}</pre>")
        for answer in answers:
            if "image/png" in answer:
                parts.append(f'<img src="data:image/png;base64,{answer["image/png"]}">')
            else:
                parts.append("".join(answer["text/html"]))
    page = browser.new_context(viewport={"width": 1050, "height": 800}).new_page()
    page.set_content("".join(parts))
    page.wait_for_timeout(SETTLED)
    keep(page, "notebook", colours=128, whole=True)


def drawing() -> None:
    """The plate's."""
    design = optimise_plate(load_robot("aria"), load_plate("table2"))
    drawn = io.BytesIO(pdf_of(plate_drawing(fixture_of(design.plate)), "png"))
    Image.open(drawn).convert("L").save(PICTURES / "drawing-plate.png", optimize=True)


def main(requested: list[str]) -> None:
    """Make the pictures that are asked for."""
    if not requested or "drawing" in requested:
        drawing()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("chromium-headless-shell"), args=FLAGS
        )
        for make in (notebook, tour):
            if not requested or make.__name__ in requested:
                make(browser)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])

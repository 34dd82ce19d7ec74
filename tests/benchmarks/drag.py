"""Time of one drag step on the server and in a real browser.  Run: python tests/benchmarks/drag.py

One step moves a target of ten: inverse kinematics, all indices, contributions, predicted error, error of
every cube; drawing prepares and queues every message for the page. Printed in ms: median and 95th
percentile of 300 steps, with 1 000 and 10 000 cubes; and the processor's time, which other programs on the
machine do not lengthen. In headless Chromium (`--browser`): from the pointer's
move to the changed number on the page, and how many updates a second the page showed during a drag.
"""

import shutil
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, sync_playwright

from workbench.arm.built_in_arms import load_robot
from workbench.plate.cubes import map_cubes
from workbench.plate.plate_toml import load_plate
from workbench.session import Session, start
from workbench.session.commands.drag import GrabTarget, MoveTarget
from workbench.session.commands.region import SetRegion, ShowCubes, corner
from workbench.session.cubes import values
from workbench.session.state import CubeView, Field
from workbench.views.page import html
from workbench.views.page.app import App

sys.path.insert(0, str(Path(__file__).parents[1] / "views" / "page"))
from conftest import DRAWN, FLAGS, SIZE, Screen

STEPS = 300
CUBES = (1_000, 10_000)
SECONDS = 4.0
PROBE = """() => {
  window.__moves = []; window.__shown = []; let last = null;
  const read = () => {
    const text = document.querySelector('[data-testid="index"]')?.innerText;
    if (text && text !== last) { last = text; window.__shown.push(performance.now()); }
  };
  read(); window.__shown.length = 0;
  new MutationObserver(read).observe(
    document.body, {subtree: true, childList: true, characterData: true});
  window.addEventListener('pointermove', e => window.__moves.push(performance.now()), true);
}"""


def moves(session: Session):
    """Along a small circle, turning a little."""
    begin = session.plate.targets[0]
    for k in range(STEPS):
        angle = 2.0 * np.pi * k / 60
        x, y = np.cos(angle), np.sin(angle)
        xyz = begin.xyz + np.array([0.04 * x - 0.04, 0.04 * y, 0.04 * x * y])
        rpy = begin.rpy + np.array([0.1 * y, 0.1 * x, 0.0])
        yield MoveTarget(0, tuple(map(float, xyz)), tuple(map(float, rpy)), client=1)


def with_cubes(session: Session, number: int) -> Session:
    """The session with about so many cubes in its region, coloured by the predicted error."""
    region = session.plate.region
    side = float((np.prod(region.size) / number) ** (1 / 3))
    while replace(region, cube=side).cubes < number:
        side *= 0.995
    plate = replace(session.plate, region=replace(region, cube=side))
    names = session.score.linearisation.names
    rotations = plate.poses[:8, :3, :3]
    cubes = map_cubes(session.robot, plate.region, rotations, names=names)
    view = CubeView(field=Field.PREDICTED)
    return replace(session, plate=plate, cubes=cubes, sampled=plate.region, cube_view=view)


def report(words: str, times: list[tuple[float, float]]) -> None:
    """One line."""
    (wall, cpu), (late, late_cpu) = np.median(times, 0), np.percentile(times, 95, axis=0)
    print(
        f"{words:<34} {wall:7.2f} ms   p95 {late:7.2f} ms   "
        f"(processor {cpu:6.2f} ms, p95 {late_cpu:6.2f} ms)",
        flush=True,
    )


def on_the_server(first: Session, app: App) -> None:
    """Computing alone, then with drawing."""
    for number in CUBES:
        session = with_cubes(first, number)
        for words, draw in (("step", values), ("step with drawing", app.view.draw)):
            draw(session)
            now, times = GrabTarget(0, client=1).apply(session), []
            for move in moves(session):
                begin, cpu = time.perf_counter(), time.thread_time()
                move.check(now)
                now = move.apply(now)
                draw(now)
                times.append((1e3 * (time.perf_counter() - begin), 1e3 * (time.thread_time() - cpu)))
            report(f"{words}, {len(session.cubes)} cubes", times)


def in_the_browser(app: App, number: int) -> None:
    """A drag of the gizmo in headless Chromium, with about so many cubes."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), headless=True, args=FLAGS
        )
        page = browser.new_context(viewport=SIZE, device_scale_factor=1).new_page()
        page.goto(f"{app.url}/?fixedDpr=1")
        page.wait_for_selector('[data-testid="index"]', timeout=60_000)
        page.wait_for_function(DRAWN, timeout=60_000)
        if number:
            show_cubes(app, number)
            page.wait_for_timeout(3000)
        screen = Screen(page, app, next(iter(app.server.get_clients().values())))
        at, metre = screen.grab(0)
        page.evaluate(PROBE)
        rate = updates_a_second(page, at, metre)
        latency = [gesture_to_number(page, at - metre * (0.01 + 0.004 * (k % 5))) for k in range(12)]
        page.mouse.up()
        page.wait_for_timeout(1000)
        app.worker.wait(30.0)
        shown = page.locator('[data-testid="predicted"]').inner_text()
        wanted = f"{html.number(1e3 * app.worker.session.score.position)} mm"
        print(
            f"browser, {number} cubes: gesture to number {statistics.median(latency):.0f} ms median, "
            f"{max(latency):.0f} ms max; {rate:.1f} updates/s; "
            f"{'right at the end' if shown == wanted else f'STALE: {shown}, not {wanted}'}",
            flush=True,
        )
        browser.close()


def show_cubes(app: App, number: int) -> None:
    """Cut the region into about so many cubes and show them."""
    region = with_cubes(app.worker.session, number).plate.region
    app.worker.submit(SetRegion(corner(region.min), corner(region.max), region.cube))
    app.worker.submit(ShowCubes(CubeView(field=Field.PREDICTED)))
    app.worker.wait(60.0)


def updates_a_second(page: Page, at: np.ndarray, metre: np.ndarray) -> float:
    """Changes of the number on the page while the pointer swings to and fro."""
    begin, k = time.perf_counter(), 0
    while time.perf_counter() - begin < SECONDS:
        k += 1
        page.mouse.move(*(at - metre * 0.05 * np.sin(0.1 * k)))
        page.wait_for_timeout(8)
    return len(page.evaluate("() => window.__shown")) / (time.perf_counter() - begin)


def gesture_to_number(page: Page, place: np.ndarray) -> float:
    """From one move of the pointer to the next change of the number [ms]."""
    page.wait_for_timeout(300)
    shown, moved = page.evaluate("() => [window.__shown.length, window.__moves.length]")
    page.mouse.move(*place)
    page.wait_for_function("n => window.__shown.length > n", arg=shown, timeout=30_000)
    begin, end = page.evaluate("n => [window.__moves[n[1]], window.__shown[n[0]]]", [shown, moved])
    return end - begin


def main() -> None:
    """Print the lines."""
    begin = time.perf_counter()
    session = start(load_robot("aria"), load_plate("table2"))
    print(f"session start {1e3 * (time.perf_counter() - begin):8.1f} ms")
    app = App(session.robot, session.plate)
    on_the_server(session, app)
    app.close()
    if "--browser" in sys.argv:
        for number in (0, *CUBES):
            app = App(session.robot, session.plate)
            in_the_browser(app, number)
            app.close()


if __name__ == "__main__":
    main()

"""Time of one drag step on the server and in a real browser.  Run: python tests/benchmarks/drag.py

One step moves a target of ten: inverse kinematics, all indices, contributions, predicted error, error of
every cube; drawing prepares and queues every message for the page. Printed in ms: median and 95th
percentile of 300 steps, with 1 000 and 10 000 cubes; and the processor's time, which other programs on the
machine do not lengthen. In headless Chromium (`--browser`), side by side with a bare viser page that holds
one gizmo and one number: from the pointer's move to the changed number on the page, and how many updates a
second the page showed during a drag; with cubes, and with as many measured points as the largest public file.
"""

import multiprocessing
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import viser
from playwright.sync_api import Page, sync_playwright

from workbench.arm.built_in_arms import load_robot
from workbench.arm.motion import Motion
from workbench.data.simulation.instruments import instrument_named
from workbench.data.simulation.simulate import simulate
from workbench.data.writer import write_measurements
from workbench.plate.cubes import map_cubes
from workbench.plate.plate_toml import load_plate
from workbench.session import Session, start
from workbench.session.commands.data import LoadData
from workbench.session.commands.drag import GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.messages import OpenTab
from workbench.session.commands.region import SetRegion, ShowCubes, corner
from workbench.session.cubes import values
from workbench.session.state import CubeView, Field, Tab
from workbench.views.page import html
from workbench.views.page.app import App

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import DRAWN, FLAGS, SIZE, Screen, browser_program

STEPS = 300
CUBES = (1_000, 10_000)
SECONDS, LATENCIES = 6.0, 20
PROBE = """() => {
  window.__moves = []; window.__shown = []; window.__steps = -1; let last, step;
  const text = () => document.querySelector('[data-testid="index"]').textContent;
  const read = () => { if (text() !== last) { last = text(); window.__shown.push(performance.now()); } };
  const count = () => {
    const now = window.__viserMutable.nodePoseData["/arm/nominal/body6"]?.position.join() ?? text();
    if (now !== step) { step = now; window.__steps++; }
    requestAnimationFrame(count);
  };
  read(); window.__shown.length = 0; count();
  new MutationObserver(read).observe(document.body, {subtree: true, childList: true, characterData: true});
  window.addEventListener('pointermove', e => window.__moves.push(performance.now()), true);
}"""
"""A step is an update of the number; where it has three digits, many steps don't change it: the arm's pose,
which comes behind the number, is counted there."""


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


Measured = tuple[float, float, float]
"""Median time from gesture to number [ms]; updates and frames a second."""


@dataclass(frozen=True)
class Server:
    """A page's server, in a process of its own as in use: the hand that drags takes no time from it."""

    url: str
    calls: Connection

    def ask(self, what: str) -> Any:
        self.calls.send(what)
        return self.calls.recv()

    def screen(self, page: Page) -> Screen:
        """The page with where gizmo and camera are."""
        handle, camera = self.ask("view")
        gizmo = SimpleNamespace(handles={"arrows": SimpleNamespace(**handle)})
        app = SimpleNamespace(view=SimpleNamespace(gizmo=gizmo))
        return Screen(page, app, SimpleNamespace(camera=SimpleNamespace(**camera)), [])


def view(gizmo: viser.TransformControlsHandle, server: viser.ViserServer) -> tuple[dict, dict]:
    """Where gizmo and camera are."""
    camera = next(iter(server.get_clients().values())).camera
    return (
        {"position": gizmo.position, "scale": gizmo.scale},
        {"position": camera.position, "wxyz": camera.wxyz, "fov": camera.fov},
    )


def serve_bare(calls: Connection) -> None:
    """A viser page that holds one gizmo and one number, and computes nothing."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    number = server.gui.add_html('<div data-testid="index">0</div>')
    gizmo = server.scene.add_transform_controls("/gizmo", scale=0.2, disable_rotations=True)
    server.initial_camera.position, server.initial_camera.look_at = (1.0, -0.9, 0.7), (0.0, 0.0, 0.0)

    @gizmo.on_update
    async def _(event: viser.TransformControlsEvent) -> None:
        number.content = f'<div data-testid="index">{event.target.position[1]:.6f}</div>'

    calls.send(f"http://127.0.0.1:{server.get_port()}")
    while calls.recv() != "end":
        calls.send(view(gizmo, server))
    server.stop()


def serve(calls: Connection, cubes: int, points: int) -> None:
    """The workbench, with so many cubes and measured points."""
    app = App(load_robot("aria"), load_plate("table2"))
    if points:
        with_points(app, points)
    if cubes:
        show_cubes(app, cubes)
    calls.send(app.url)
    while (what := calls.recv()) != "end":
        if what == "view":
            calls.send(view(app.view.gizmo.handles["arrows"], app.server))
        else:
            app.worker.wait(30.0)
            calls.send(f"{html.number(1e3 * app.worker.session.score.position)} mm")
    app.close()


@contextmanager
def served(target: Callable[..., None], *options: int) -> Iterator[Server]:
    """A server until its page is closed."""
    spawn = multiprocessing.get_context("spawn")
    here, there = spawn.Pipe()
    process = spawn.Process(target=target, args=(there, *options))
    process.start()
    yield Server(here.recv(), here)
    here.send("end")
    process.join(30.0)


@contextmanager
def page_of(url: str) -> Iterator[Page]:
    """A page in headless Chromium."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_program(), headless=True, args=FLAGS)
        page = browser.new_context(viewport=SIZE, device_scale_factor=1).new_page()
        page.goto(f"{url}/?fixedDpr=1")
        page.wait_for_selector('[data-testid="index"]', timeout=60_000)
        yield page
        browser.close()


def dragged(screen: Screen) -> Measured:
    """A drag of the gizmo: quick for its updates, slow for its latency."""
    page = screen.page
    at, metre = screen.grab(1)  # across: along x the error hardly changes
    page.evaluate(PROBE)
    rate, frames = a_second(page, at, metre)
    latency = [gesture_to_number(page, at - metre * (0.01 + 0.05 * (k % 2))) for k in range(LATENCIES)]
    page.mouse.up()
    return statistics.median(latency), rate, frames


def on_a_bare_page() -> Measured:
    """A drag of a bare page's gizmo."""
    with served(serve_bare) as server, page_of(server.url) as page:
        page.wait_for_timeout(3000)
        return dragged(server.screen(page))


def in_the_browser(cubes: int, points: int) -> Measured:
    """A drag of a target."""
    with served(serve, cubes, points) as server, page_of(server.url) as page:
        page.wait_for_function(DRAWN, timeout=60_000)
        page.wait_for_timeout(3000)
        found = dragged(server.screen(page))
        page.wait_for_timeout(1000)
        shown, wanted = page.locator('[data-testid="predicted"]').inner_text(), server.ask("predicted")
        if not shown.startswith(wanted):
            print(f"STALE: {shown}, not {wanted}")
    return found


def with_points(app: App, number: int) -> None:
    """Show so many measured points, coloured by an error."""
    rng = np.random.default_rng(0)
    low, high = app.worker.session.robot.search_limits.T
    q = rng.uniform(low, high, (number, len(low)))
    rows = simulate(app.worker.session.robot, Motion(q), instrument=instrument_named("ideal"), rng=rng)
    content = write_measurements(rows, Path(tempfile.mkdtemp()) / "points.csv").read_bytes()
    app.worker.submit(LoadData("points.csv", content))
    app.worker.wait(120.0)
    app.worker.submit(OpenTab(Tab.PLATE))
    app.worker.submit(SelectTarget(0))
    app.worker.wait(120.0)


def side_by_side() -> None:
    """The page against a bare one in one run: what the drag itself costs."""
    bare = on_a_bare_page()
    print(
        f"bare page: gesture to number {bare[0]:.0f} ms median; "
        f"{bare[1]:.1f} updates/s, {bare[2]:.1f} frames/s"
    )
    for words, cubes, points in (
        ("no cubes", 0, 0),
        ("1 000 cubes", 1_000, 0),
        ("10 000 cubes", 10_000, 0),
        ("11 911 measured points", 0, 11_911),
    ):
        median, rate, frames = in_the_browser(cubes, points)
        print(
            f"{words}: gesture to number {median:.0f} ms median ({median / bare[0]:.2f} × bare); "
            f"{rate:.1f} updates/s ({rate / bare[1]:.2f} × bare), {frames:.1f} frames/s",
            flush=True,
        )


def show_cubes(app: App, number: int) -> None:
    """Cut the region into about so many cubes and show them."""
    region = with_cubes(app.worker.session, number).plate.region
    app.worker.submit(SetRegion(corner(region.min), corner(region.max), region.cube))
    app.worker.submit(ShowCubes(CubeView(field=Field.PREDICTED)))
    app.worker.wait(60.0)


def a_second(page: Page, at: np.ndarray, metre: np.ndarray) -> tuple[float, float]:
    """Steps and frames of the page while the pointer swings to and fro."""
    read = "() => [window.__steps, window.__viserTestpoints.rendererInfo.render.frame]"
    begin, k, before = time.perf_counter(), 0, page.evaluate(read)
    while time.perf_counter() - begin < SECONDS:
        k += 1
        page.mouse.move(*(at - metre * 0.05 * np.sin(0.1 * k)))
        page.wait_for_timeout(8)
    seconds = time.perf_counter() - begin
    steps, frames = (np.array(page.evaluate(read)) - before) / seconds
    return steps, frames


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
        side_by_side()


if __name__ == "__main__":
    main()

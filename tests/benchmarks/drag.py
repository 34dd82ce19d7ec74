"""Time of one drag step on the server and in a real browser.  Run: python tests/benchmarks/drag.py

One step moves a target of ten: inverse kinematics, all indices, contributions, predicted error, error of
every cube; drawing prepares and queues every message for the page. Printed in ms: median and 95th
percentile of 300 steps, with 1 000 and 10 000 cubes; and the processor's time, which other programs on the
machine do not lengthen. In headless Chromium (`--browser`), beside a bare viser page that holds one gizmo
and one number, in turns, so that whatever else runs slows down both: from the pointer's move to the changed
number on the page, and how many updates a second the page showed during a drag; with cubes, and with as many
measured points as the largest public file.  `--browser-only`: that alone, in less than three minutes.
"""

import multiprocessing
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

from workbench import Motion, load_plate, load_robot, write_measurements
from workbench.data.simulation.instruments import instrument_named
from workbench.data.simulation.simulate import simulate
from workbench.plate.cube_map import map_cubes
from workbench.report.numbers import compared
from workbench.session import Session, start
from workbench.session.commands.data import LoadData
from workbench.session.commands.drag import GrabTarget, MoveTarget, SelectTarget, plain
from workbench.session.commands.messages import OpenTab
from workbench.session.commands.region import SetRegion, ShowCubes
from workbench.session.cube_fields import drawn_field
from workbench.session.page_state import Tab
from workbench.session.state import CubeView
from workbench.views.page.app import App

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import DRAWN, FLAGS, SIZE, Screen, browser_program

STEPS = 300
CUBES = (1_000, 10_000)
SECONDS, LATENCIES = 4.0, 20
FAR = 0.05
"""How far a gesture goes [m]: a few millimetres may leave every digit of the number as it is."""
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
    view = CubeView(field="predicted")
    return replace(session, plate=plate).updated("region", cubes=cubes, sampled=plate.region, view=view)


def report(text: str, times: list[tuple[float, float]]) -> None:
    """One line."""
    (wall, cpu), (late, late_cpu) = np.median(times, 0), np.percentile(times, 95, axis=0)
    print(
        f"{text:<34} {wall:7.2f} ms   p95 {late:7.2f} ms   (processor {cpu:6.2f} ms, p95 {late_cpu:6.2f} ms)",
        flush=True,
    )


def on_the_server(first: Session, app: App) -> None:
    """Computing alone, then with drawing."""
    for number in CUBES:
        session = with_cubes(first, number)
        numbers = lambda now: None if (field := drawn_field(now)) is None else field.values(now)  # noqa: E731
        for text, draw in (("step", numbers), ("step with drawing", app.view.draw)):
            draw(session)
            now, times = GrabTarget(0, client=1).apply(session), []
            for move in moves(session):
                begin, cpu = time.perf_counter(), time.thread_time()
                move.check(now)
                now = move.apply(now)
                draw(now)
                times.append((1e3 * (time.perf_counter() - begin), 1e3 * (time.thread_time() - cpu)))
            report(f"{text}, {len(session.region.cubes)} cubes", times)


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
        region = with_cubes(app.worker.session, cubes).plate.region
        app.worker.submit(SetRegion(plain(region.min), plain(region.max), region.cube))
        app.worker.submit(ShowCubes(CubeView(field="predicted")))
        app.worker.wait(60.0)
    calls.send(app.url)
    while (what := calls.recv()) != "end":
        if what == "view":
            calls.send(view(app.view.gizmo.handles["arrows"], app.server))
        else:
            app.worker.wait(30.0)
            calls.send(f"{compared(1e3 * app.worker.session.score.position)} mm")
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
def pages_of(*urls: str) -> Iterator[list[Page]]:
    """Pages in headless Chromium, each in a browser of its own: none waits for what another draws."""
    with sync_playwright() as playwright:
        launch = playwright.chromium.launch
        program = browser_program()
        browsers = [launch(executable_path=program, headless=True, args=FLAGS) for _ in urls]
        pages = [each.new_context(viewport=SIZE, device_scale_factor=1).new_page() for each in browsers]
        for page, url in zip(pages, urls, strict=True):
            page.goto(f"{url}/?fixedDpr=1")
        for page in pages:
            page.wait_for_selector('[data-testid="index"]', timeout=60_000)
        yield pages
        for browser in browsers:
            browser.close()


class Hand:
    """Holds the gizmo of a page by an arrow, across: along x the error hardly changes."""

    def __init__(self, screen: Screen):
        self.page = screen.page
        self._at, self._metre = screen.grab(1)
        self.page.evaluate(PROBE)

    def swing(self) -> tuple[float, float]:
        """Steps and frames a second while the pointer swings to and fro."""
        read = "() => [window.__steps, window.__viserTestpoints.rendererInfo.render.frame]"
        begin, k, before = time.perf_counter(), 0, self.page.evaluate(read)
        while time.perf_counter() - begin < SECONDS:
            k += 1
            self._move(0.05 * np.sin(0.1 * k))
            self.page.wait_for_timeout(8)
        seconds = time.perf_counter() - begin
        steps, frames = np.subtract(self.page.evaluate(read), before) / seconds
        return float(steps), float(frames)

    def rest(self, place: float) -> None:
        """Go there, and wait for a number that stays."""
        self._move(place)
        before = -1
        while before != (before := self.page.evaluate("window.__shown.length")):
            self.page.wait_for_timeout(500)

    def gesture(self, place: float) -> float:
        """From one move of the pointer, far enough to change the number, to its change [ms]."""
        self.page.wait_for_timeout(300)
        counts = self.page.evaluate("[window.__moves.length, window.__shown.length]")
        self._move(place)
        self.page.wait_for_function("n => window.__shown.length > n", arg=counts[1], timeout=30_000)
        begin, end = self.page.evaluate("n => [window.__moves[n[0]], window.__shown[n[1]]]", counts)
        return end - begin

    def _move(self, place: float) -> None:
        self.page.mouse.move(*(self._at - self._metre * place))


def beside_bare(cubes: int, points: int) -> list[Measured]:
    """Drags of a bare page's gizmo and of a target, in turns: quick for updates, slow for latency."""
    with (
        served(serve_bare) as bare,
        served(serve, cubes, points) as ours,
        pages_of(bare.url, ours.url) as (bare_page, page),
    ):
        page.wait_for_function(DRAWN, timeout=60_000)
        page.wait_for_timeout(3000)
        hands = Hand(bare.screen(bare_page)), Hand(ours.screen(page))
        rates = [hand.swing() for hand in hands]
        for hand in hands:
            hand.rest(FAR)
        latencies = [[hand.gesture(FAR * (k % 2)) for hand in hands] for k in range(LATENCIES)]
        page.mouse.up()
        page.wait_for_timeout(1000)
        shown, wanted = page.locator('[data-testid="predicted"]').inner_text(), ours.ask("predicted")
        if not shown.startswith(wanted):
            print(f"STALE: {shown}, not {wanted}")
    medians = np.median(latencies, axis=0)
    return [(median, *rate) for median, rate in zip(medians.tolist(), rates, strict=True)]


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
    for text, cubes, points in (
        ("no cubes", 0, 0),
        ("1 000 cubes", 1_000, 0),
        ("10 000 cubes", 10_000, 0),
        ("11 911 measured points", 0, 11_911),
    ):
        bare, ours = beside_bare(cubes, points)
        print(
            f"{text}: gesture to number {ours[0]:.0f} ms median, bare page {bare[0]:.0f} "
            f"({ours[0] / bare[0]:.2f} ×); {ours[1]:.1f} updates/s, bare {bare[1]:.1f} "
            f"({ours[1] / bare[1]:.2f} ×); {ours[2]:.1f} frames/s",
            flush=True,
        )


def main() -> None:
    """Print the lines."""
    if "--browser-only" not in sys.argv:
        begin = time.perf_counter()
        session = start(load_robot("aria"), load_plate("table2"))
        print(f"session start {1e3 * (time.perf_counter() - begin):8.1f} ms")
        app = App(session.robot, session.plate)
        on_the_server(session, app)
        app.close()
    if {"--browser", "--browser-only"} & {*sys.argv}:
        side_by_side()


if __name__ == "__main__":
    main()

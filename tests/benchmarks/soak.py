"""Memory, files, threads and the time of a drag step over a long session that several browsers drag in.

Run: python tests/benchmarks/soak.py --minutes 30 --browsers 5 --check

The page is served and recorded as `workbench serve` does it; one other process opens the browsers and drags
target 1 in each of them in turn. A line a minute; at the end what is bounded in every minute: after a sixth
of the time memory may grow by 5 %, and files and threads stay as many; a drag step may take 1.5 times as long
as in the first minute, at the 95th percentile.

Memory is that of the process that serves, the most of a minute: what is drawn waits up to 20 s before it is
written. A step takes from its oldest gesture that nothing has shown yet until all is drawn. That includes
waiting for a processor, which the browsers keep busy; the session's own share of a step is told beside it.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from dataclasses import replace
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

from workbench.arm.built_in_arms import load_robot
from workbench.base.threads import one_thread
from workbench.plate.plate_toml import load_plate
from workbench.session import AbstractView
from workbench.session.commands.drag import MoveTarget
from workbench.session.journal.folder import begin
from workbench.views.page.app import App
from workbench.views.recording.recorder import recorder

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import DRAWN, FLAGS, SIZE, browser_program

HANDLE = "/handles/arrows"
PIXEL = """([node, offset]) => {
  const seen = window.__viserMutable, [w, x, y, z] = seen.nodePoseData[''].wxyz;
  const p = seen.nodePoseData[node].position.map((v, i) => v + offset[i]);
  const t = [2*(y*p[2]-z*p[1]), 2*(z*p[0]-x*p[2]), 2*(x*p[1]-y*p[0])];
  const v = [p[0]+w*t[0]+y*t[2]-z*t[1], p[1]+w*t[1]+z*t[0]-x*t[2], p[2]+w*t[2]+x*t[1]-y*t[0], 1];
  const by = (m, v) => [0, 1, 2, 3].map(i => m[i]*v[0] + m[4+i]*v[1] + m[8+i]*v[2] + m[12+i]*v[3]);
  const c = by(seen.camera.projectionMatrix.elements, by(seen.camera.matrixWorldInverse.elements, v));
  const box = seen.canvas.getBoundingClientRect();
  return [box.x + box.width * (1 + c[0]/c[3]) / 2, box.y + box.height * (1 - c[1]/c[3]) / 2];
}"""
"""Where on the page a place is that lies off a node [m]."""


class Timed(AbstractView):
    """Drawn last: how long steps took from their gesture on, and of the session's processor time [ms]."""

    def __init__(self, worker):
        self.times, self._waiting, self._used = [], deque(), 0.0
        worker.listen(self._heard)

    def _heard(self, command):
        if isinstance(command, MoveTarget):
            self._waiting.append((time.perf_counter(), command))

    def draw(self, session):
        used, before = time.thread_time(), self._used
        self._used = used
        shown = [i for i, (_, move) in enumerate(tuple(self._waiting)) if is_at(session, move)]
        if shown:
            self.times.append((1e3 * (time.perf_counter() - self._waiting[0][0]), 1e3 * (used - before)))
            for _ in range(shown[-1] + 1):
                self._waiting.popleft()

    def close(self):
        pass


def is_at(session, move):
    """Whether a target stands where this move put it."""
    return tuple(session.plate.targets[move.target].xyz.tolist()) == tuple(move.xyz)


def drag_for_ever(url, count):
    """The other process: open so many pages, and drag in each in turn."""
    along = 0.9 * 0.17 * load_robot("aria").reach
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_program(), headless=True, args=FLAGS)
        pages = [browser.new_context(viewport=SIZE).new_page() for _ in range(count)]
        for page in pages:
            page.goto(f"{url}/?fixedDpr=1")
            page.wait_for_function(DRAWN, timeout=300_000)
        while True:
            for page in pages:
                x, y = page.evaluate(PIXEL, [HANDLE, [along, 0.0, 0.0]])
                page.mouse.move(x, y)
                page.wait_for_timeout(100)
                page.mouse.down()
                for k in range(1, 41):
                    page.mouse.move(x + 25.0 * np.sin(2.0 * np.pi * k / 40), y)
                page.mouse.up()


def held():
    """Memory [MB], open files and threads of this process."""
    lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(lines["VmRSS"].split()[0]) / 1024, len(os.listdir("/proc/self/fd")), threading.active_count()


def soak(minutes, browsers):
    """A row a minute: most memory, files, threads, steps, and their 95th percentiles."""
    with tempfile.TemporaryDirectory() as folder, one_thread():
        begun = begin(load_robot("aria"), load_plate("table2"), folder=Path(folder) / "soak")
        begun = replace(begun, keepers=(*begun.keepers, recorder(begun.folder)))
        app = App(begun.session.robot, begun.session.plate, begun=begun)
        timed = Timed(app.worker)
        app.worker.add_view(timed)
        others = subprocess.Popen([sys.executable, __file__, "--drag", app.url, "--browsers", str(browsers)])
        rows = []
        try:
            while not timed.times and others.poll() is None:
                time.sleep(0.5)
            for minute in range(1, minutes + 1):
                maximum = 0.0
                for _ in range(60):
                    time.sleep(1.0)
                    maximum = max(maximum, held()[0])
                times, timed.times = timed.times, []
                late = np.percentile(times, 95, axis=0) if times else (np.nan, np.nan)
                rows.append((maximum, *held()[1:], len(times), *late))
                text = "minute {:3d}: {:7.1f} MB, {:3d} files, {:3d} threads, {:5d} steps, p95 {:7.1f} ms"
                text += ", {:5.1f} ms of the processor"
                print(text.format(minute, *rows[-1]), flush=True)
        finally:
            others.terminate()
            others.wait()
            app.close()
    return np.array(rows)


def main():
    """Print the lines, and what is bounded."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=int, default=30)
    parser.add_argument("--browsers", type=int, default=5)
    parser.add_argument("--check", action="store_true", help="a bound that is broken is the exit status")
    parser.add_argument("--drag", metavar="URL", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.drag:
        drag_for_ever(options.drag, options.browsers)
    rows = soak(options.minutes, options.browsers)
    begun = max(0, len(rows) // 6 - 1)
    (memory, files, threads, *_), later = rows[begun], rows[begun:]
    maximum, slowest = later[:, 0].max() / memory, rows[:, 4].max() / rows[0, 4]
    bounds = {
        f"memory {100.0 * (maximum - 1.0):+.1f} % (at most +5)": maximum <= 1.05,
        f"p95 {slowest:.2f} × the first minute's (at most 1.5)": slowest <= 1.5,
        f"files {files:.0f}, {later[:, 1].min():.0f} to {later[:, 1].max():.0f}": (
            later[:, 1] == files
        ).all(),
        f"threads {threads:.0f}, {later[:, 2].min():.0f} to {later[:, 2].max():.0f}": (
            later[:, 2] == threads
        ).all(),
    }
    for text, is_kept in bounds.items():
        print("✓" if is_kept else "✗", text)
    if options.check and not all(bounds.values()):
        raise SystemExit(1)


if __name__ == "__main__":
    main()

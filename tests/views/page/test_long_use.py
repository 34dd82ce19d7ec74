"""A page among hostile programs and in long use: it goes on, and its memory, files and threads stay bounded.

`SOAK=600 pytest -m slow tests/views/page/test_long_use.py` soaks for ten minutes.
"""

import dataclasses
import os
import random
import threading
import time
from contextlib import suppress
from pathlib import Path

import msgspec
import pytest
import viser
import websockets
import websockets.sync.client as client
from viser.infra._messages import Message

from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.replay import restore
from workbench.views.page.app import App

pytestmark = pytest.mark.slow
SECONDS = float(os.environ.get("SOAK", 30.0))
HOSTILE = 2_000
WORDS = (
    *(None, True, -1, 1e300, float("nan"), "x", "", b"\0" * 10, 2**62),
    *([], [1, 2], {}, {"a": 1}, [1e300] * 3, [float("nan")] * 4),
)
HANDLES = ("/handles/arrows", "/handles/rings", "/handles/slice")


@pytest.fixture
def app(first, tmp_path):
    begun = begin(first.robot, first.plate, folder=tmp_path / "session")
    running = App(first.robot, first.plate, begun=begun)
    yield running
    running.close()


def dialled(app):
    address = f"ws://127.0.0.1:{app.server.get_port()}"
    return client.connect(address, subprotocols=[f"viser-v{viser.__version__}"], max_size=None)


def packed(**message) -> bytes:
    return msgspec.msgpack.encode(message)


def drag(socket, place, steps=40):
    """A drag of the selected target by as many moves."""
    x, y, z = place.tolist()
    where = {"name": HANDLES[0], "wxyz": (1.0, 0.0, 0.0, 0.0)}
    socket.send(packed(type="TransformControlsDragStartMessage", name=HANDLES[0], owner=""))
    for k in range(steps):
        position = (x + 0.0002 * (k % 20), y, z)
        socket.send(packed(type="TransformControlsUpdateMessage", position=position, **where))
        time.sleep(0.02)
    socket.send(packed(type="TransformControlsDragEndMessage", name=HANDLES[0]))


def hostile(rng: random.Random, names: list[str]) -> bytes:
    """A message that no page would send, or one whose fields are wrong."""
    if rng.random() < 0.1:
        return rng.randbytes(rng.randrange(40))
    kinds = {n: k for n, k in Message._subclass_from_type_string().items() if dataclasses.is_dataclass(k)}
    kind = rng.choice(sorted(kinds))

    def value(name: str) -> object:
        if rng.random() < 0.7 and "uuid" in name:
            return rng.choice(names)
        if rng.random() < 0.7 and name == "name":
            return rng.choice(HANDLES)
        return {"value": rng.choice(WORDS)} if name == "updates" else rng.choice(WORDS)

    given = (f.name for f in dataclasses.fields(kinds[kind]) if f.init and rng.random() < 0.95)
    fields = {name: value(name) for name in given}
    return msgspec.msgpack.encode({"type": kind, **fields})


def held() -> tuple[float, int, int]:
    """Memory [MB], open files and threads of this process."""
    lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(lines["VmRSS"].split()[0]) / 1024, len(os.listdir("/proc/self/fd")), threading.active_count()


def test_after_hostile_messages_a_target_can_be_dragged(app, caplog):
    rng, names = random.Random(0), list(app.server.gui._gui_input_handle_from_uuid)
    for _ in range(HOSTILE // 20):
        with dialled(app) as socket, suppress(websockets.ConnectionClosed):
            for _ in range(20):
                socket.send(hostile(rng, names))
    assert not [record for record in caplog.records if record.exc_info]
    assert app.worker.wait(60.0)
    before = app.worker.session
    with dialled(app) as socket:
        drag(socket, before.plate.poses[before.selected][:3, 3])
        time.sleep(2.0)
        assert app.worker.wait(60.0)
    assert app.worker.session.plate is not before.plate
    assert app.worker.session.drag is None


def test_long_use_takes_no_more_memory_files_or_threads(app, tmp_path):
    session = app.worker.session
    place, rows = session.plate.poses[session.selected][:3, 3], []
    with dialled(app) as one, dialled(app) as other:
        for socket in (one, other):  # nobody reads what a page gets
            threading.Thread(target=lambda s=socket: [None for _ in s], daemon=True).start()
        ends = time.monotonic() + SECONDS
        while time.monotonic() < ends:
            for socket in (one, other):
                drag(socket, place)
            rows.append(held())
    memory, files, threads = zip(*rows, strict=True)
    later = len(rows) // 3
    assert max(memory[later:]) < 1.1 * max(memory[: later + 1])
    assert max(files[later:]) <= max(files[: later + 1]) + 2
    assert max(threads[later:]) <= max(threads[: later + 1]) + 2
    assert app.worker.wait(60.0)
    app.worker.close()
    assert not restore(read_recording(tmp_path / "session")).warning

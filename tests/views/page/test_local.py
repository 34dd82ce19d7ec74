"""The door: only pages of this server get in, and nobody opens a tunnel."""

import signal
import subprocess
import sys
import time
import urllib.error
import urllib.parse
import urllib.request

import msgspec
import pytest
import viser
import websockets
import websockets.sync.client as client
from viser import _messages

from workbench.views.page import viser_internals
from workbench.views.page.local_server import local_server, page_address
from workbench.views.page.scene.gizmo import Gizmo
from workbench.views.page.viser_internals import hand_over


@pytest.fixture
def server():
    running = local_server()
    yield running
    running.stop()


def dialled(port: int, **options):
    """A program that speaks viser's language."""
    return client.connect(f"ws://127.0.0.1:{port}", subprotocols=[f"viser-v{viser.__version__}"], **options)


def dial(port: int, **options) -> str:
    try:
        with dialled(port, **options) as socket:
            socket.recv(timeout=60)
        return "open"
    except websockets.InvalidStatus as error:
        return str(error.response.status_code)


def test_foreign_origins_are_refused(server):
    port = server.get_port()
    assert dial(port, origin=f"http://127.0.0.1:{port}") == "open"
    assert dial(port, origin=f"http://localhost:{port}") == "open"
    for origin in (
        "http://evil.example",
        "null",
        f"https://127.0.0.1:{port}",
        f"http://127.0.0.1:{port + 1}",
    ):
        assert dial(port, origin=origin) == "403", origin


def test_messages_handed_over_come_while_the_next_block_is_still_being_made(server, monkeypatch):
    """The numbers of a drag do not wait for the scene."""
    monkeypatch.setattr(viser_internals, "HANDED_OVER", 60.0)  # a busy machine takes longer than is waited
    with dialled(server.get_port()) as socket:
        socket.recv(timeout=60)
        for k in range(20):
            with server.atomic():
                server.gui.set_panel_label(f"number {k} of a drag")
            hand_over(server)
            with server.atomic():
                while f"number {k} of a drag".encode() not in socket.recv(timeout=10):
                    pass


def test_only_a_page_that_knows_the_secret_tells_anything(server):
    heard = []
    server.heard = heard.append
    port = server.get_port()
    assert get(port, f"127.0.0.1:{port}", f"{server.message_path}dark") == 204
    assert heard == ["dark"]
    get(port, f"127.0.0.1:{port}", "/messages/guessed/dark")
    assert get(port, "evil.example", f"{server.message_path}dark") == 403
    assert heard == ["dark"]


def get(port: int, host: str, path: str = "/", **headers: str) -> int:
    """Status of opening the page under that name of the host."""
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", headers={"Host": host, **given})
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def test_foreign_host_names_are_refused(server):
    port = server.get_port()
    assert get(port, f"127.0.0.1:{port}") == 200
    assert get(port, f"LOCALHOST:{port}") == 200
    for host in (f"evil.example:{port}", f"127.0.0.1:{port + 1}", "127.0.0.1", f"192.0.2.7:{port}", ""):
        assert get(port, host) == 403, host
    assert get(port, f"localhost:{port}", Origin="http://evil.example") == 403


def test_listens_on_the_loopback_only_and_offers_no_tunnel(server):
    assert server.get_host() == "127.0.0.1"
    handlers = server._websock_server._incoming_handlers
    assert not handlers.get(_messages.ShareUrlRequest)
    assert not handlers.get(_messages.ShareUrlDisconnect)


def test_no_foreign_page_may_frame_it(server):
    port = server.get_port()
    here = f"localhost:{port}"
    for place in ("iframe", "frame", "embed", "object"):
        assert get(port, here, Sec_Fetch_Site="cross-site", Sec_Fetch_Dest=place) == 403
    assert get(port, here, Sec_Fetch_Site="cross-site", Sec_Fetch_Dest="document") == 200
    with urllib.request.urlopen(page_address(server), timeout=60) as answer:
        assert answer.headers["X-Frame-Options"] == "DENY"
        assert answer.headers["Content-Security-Policy"] == "frame-ancestors 'none'"
        assert "Access-Control-Allow-Origin" not in answer.headers


def test_in_the_network_a_page_needs_the_link_and_no_foreign_origin():
    running = local_server(host="0.0.0.0")
    port = running.get_port()
    link = urllib.parse.urlsplit(page_address(running))
    there, path = f"192.0.2.7:{port}", f"/?{link.query}"
    try:
        assert link.hostname != "0.0.0.0"
        assert get(port, there, path, Origin=f"http://{there}") == 200
        assert get(port, f"localhost:{port}", path) == 200
        assert get(port, f"evil.example:{port}", path) == 403
        for origin in (f"http://evil.example:{port}", f"http://198.51.100.7:{port}"):
            assert get(port, there, path, Origin=origin) == 403
        for wrong in ("/", "/?key=", "/?key=guess"):
            assert get(port, there, wrong) == 403
        cookie = f"workbench-{port}={running.key}"
        assert get(port, there, Cookie=cookie) == 200
        assert get(port, there, Cookie=cookie + "x") == 403
        ours = {"origin": f"http://127.0.0.1:{port}"}
        assert dial(port, **ours) == "403"
        assert dial(port, **ours, additional_headers={"Cookie": cookie}) == "open"
        with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=60) as answer:
            assert answer.headers["Set-Cookie"].startswith(f"{cookie}; HttpOnly; SameSite=Strict")
    finally:
        running.stop()


def test_serve_says_where_and_ends_when_interrupted():
    program = (
        "from workbench.views.page.serve import serve\n"
        "from workbench.plate.measured_plate import load_plate\n"
        "from workbench.arm.built_in_arms import load_robot\n"
        "serve(lambda: (load_robot('aria'), load_plate('table2')), port=0, open_browser=False,\n"
        "      on_ready=lambda url: print(url, flush=True))\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    url = process.stdout.readline().strip()
    assert urllib.request.urlopen(url, timeout=60).status == 200
    process.send_signal(signal.SIGINT)
    rest, errors = process.communicate(timeout=120)
    assert (process.returncode, rest, errors) == (0, "", "")


def test_a_target_held_by_a_program_that_left_without_showing_a_page_is_free_again(server, worker):
    """Viser tells of those alone that sent where their camera is."""
    gizmo = Gizmo(server, worker, worker.session)
    grab = {"type": "TransformControlsDragStartMessage", "name": "/handles/arrows", "owner": ""}
    owners = set()
    for _ in range(2):
        with dialled(server.get_port()) as socket:
            socket.send(msgspec.msgpack.encode(grab))
            patience = time.monotonic() + 60.0
            while gizmo._dragged is None or gizmo._dragged[1] in owners:
                assert time.monotonic() < patience
                time.sleep(0.01)
            owners.add(gizmo._dragged[1])
    assert len(owners) == 2
    assert worker.wait(60.0)
    assert worker.session.drag.client == max(owners) + 1

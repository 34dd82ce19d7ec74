"""The door: only pages of this server get in, and nobody opens a tunnel."""

import pytest
import viser
import websockets
import websockets.sync.client as client
from viser import _messages

from workbench.app.local import local_server
from workbench.app.server import App
from workbench.design.plate_toml import load_plate
from workbench.errors import FileError, OptionError
from workbench.robots import load_robot


@pytest.fixture
def server():
    running = local_server()
    yield running
    running.stop()


def dial(port: int, **options) -> str:
    try:
        with client.connect(
            f"ws://127.0.0.1:{port}", subprotocols=[f"viser-v{viser.__version__}"], **options
        ) as socket:
            socket.recv(timeout=10)
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


def test_foreign_host_names_are_refused(server):
    port = server.get_port()
    assert dial(port, additional_headers={"Host": f"evil.example:{port}"}) == "403"


def test_listens_on_the_loopback_only_and_offers_no_tunnel(server):
    assert server.get_host() == "127.0.0.1"
    handlers = server._websock_server._incoming_handlers
    assert not handlers.get(_messages.ShareUrlRequest)
    assert not handlers.get(_messages.ShareUrlDisconnect)


def test_a_taken_port_is_said(server):
    with pytest.raises(OptionError):
        local_server(port=server.get_port())
    with pytest.raises(OptionError):
        local_server(port=70_000)


def test_a_missing_data_file_is_said(tmp_path):
    with pytest.raises(FileError):
        App(load_robot("aria"), load_plate("table2"), data=tmp_path / "none.csv")

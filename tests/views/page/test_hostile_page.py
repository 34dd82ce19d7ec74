"""A foreign page in a real browser: it can't read, steer or frame the workbench, nor open a tunnel."""

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
import viser

from workbench.views.page.local_server import local_server

pytestmark = pytest.mark.browser
OWN = "no-such-file"
"""What a server says that it lacks is a page of its own as well, without viser's program."""
FOREIGN = "evil.example"
"""A name that the browser of these tests takes for this machine."""
ATTACK = """async ([address, protocol]) => {
  const read = await fetch(address).then(r => r.text()).then(t => t.length, () => 'refused');
  const steer = await new Promise(done => {
    const socket = new WebSocket(address.replace('http', 'ws'), [protocol]);
    socket.onopen = () => done('open');
    socket.onerror = () => done('refused');
  });
  const frame = document.createElement('iframe');
  frame.src = address;
  const loaded = new Promise(done => { frame.onload = done; });
  document.body.append(frame);
  await loaded;
  return {read, steer};
}"""
REFUSED = {"read": "refused", "steer": "refused"}


class Page(BaseHTTPRequestHandler):
    """A page with nothing on it."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><body></body>")

    def log_message(self, *_):
        pass


@pytest.fixture
def foreign():
    """Port of a foreign page on this machine."""
    with ThreadingHTTPServer(("127.0.0.1", 0), Page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_port
        server.shutdown()


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_a_foreign_page_gets_nothing(host, foreign, chromium):
    server = local_server(host=host)
    port, protocol = server.get_port(), f"viser-v{viser.__version__}"
    page = chromium.new_page()
    try:
        for name in ("127.0.0.1", "localhost", FOREIGN):
            page.goto(f"http://{name}:{foreign}/")
            for address in (f"http://127.0.0.1:{port}/", f"http://{FOREIGN}:{port}/"):
                assert page.evaluate(ATTACK, [address, protocol]) == REFUSED, (name, address)
            inside = [frame for frame in page.frames if frame != page.main_frame]
            assert len(inside) == 2
            assert not any(frame.query_selector("#root") for frame in inside)
        rebound = page.goto(f"http://{FOREIGN}:{port}/")
        assert rebound.status == 403
        assert "workbench" in page.content()
        assert page.evaluate(ATTACK, [f"http://{FOREIGN}:{port}/", protocol])["steer"] == "refused"
        assert not server.get_clients()
        if host == "127.0.0.1":  # the same attack from the workbench's own page succeeds
            page.goto(f"http://127.0.0.1:{port}/{OWN}")
            own = page.evaluate(ATTACK, [f"http://127.0.0.1:{port}/", protocol])
            assert own["read"] > 1000
            assert own["steer"] == "open"
    finally:
        page.close()
        server.stop()

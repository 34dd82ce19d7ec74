"""A viser server for this machine only.

viser itself checks neither Host nor Origin, so any page that a user has open could read and steer the scene,
and it lets every client open a public tunnel. Here a request must name this server as its host and come from
a page of this server, and the tunnel's handlers are gone. Programs on this machine that send no Origin can
still connect: this is no login. It relies on internals of viser 1.1; a test holds them.
"""

import ipaddress
from collections.abc import Callable
from typing import Any
from unittest import mock
from urllib.parse import parse_qs, urlencode, urlsplit

import rich
import viser
import websockets.asyncio.server as websockets
from viser import _messages

from workbench.base.errors import OptionError

LOOPBACK = ("127.0.0.1", "localhost")
LABEL = "Workbench"
SESSION = "session"
"""What names the session in a link."""
EVERYWHERE = ("0.0.0.0", "::")
_print = rich.print


def _print_but_viser(*objects: Any, **options: Any) -> None:
    """`rich.print` without viser's own words: its thread says goodbye whenever it gets round to it."""
    if not (objects and str(objects[0]).startswith("[bold](viser)")):
        _print(*objects, **options)


rich.print = _print_but_viser


def local_server(
    *, host: str = "127.0.0.1", port: int = 0, label: str = LABEL, shown: Callable[[], str] = str
) -> viser.ViserServer:
    """A server that only pages of its own can talk to.

    Args:
        host: Address to listen at; the loopback address unless the user asks for another one.
        port: Port, or 0 for any free one.
        label: Name shown in the browser.
        shown: Tells the name of the session on the page, empty if it has none: a link to another one
            (`session_link`) is answered with a sentence instead of the wrong page.

    Raises:
        OptionError: the port is taken, or can't be used.
    """
    if not 0 <= port < 65536:
        raise OptionError(f"port {port} can't be used; give a number from 1 to 65535, or 0 for any free one")
    real = websockets.serve

    def serve(handler, address, port_tried, *, process_request, **options):
        def guard(connection, request):
            if not _is_ours(request, host, connection.local_address[1]):
                return connection.respond(403, "this page may not talk to the workbench\n")
            wanted, here = _session_of(request.path), shown()
            if wanted and here and wanted != here:
                return connection.respond(404, _elsewhere(wanted, here))
            return process_request(connection, request)

        return real(handler, address, port_tried, process_request=guard, **options)

    # viser looks serve() up when its thread starts, which is inside its constructor;
    # what it prints there names no page that one should open
    with mock.patch.object(websockets, "serve", serve), mock.patch("rich.print"):
        server = viser.ViserServer(host=host, port=port, label=label, verbose=False)
    if port and server.get_port() != port:
        server.stop()
        raise OptionError(f"port {port} is taken by another program; choose another one with --port")
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    return server


def page_address(server: viser.ViserServer) -> str:
    """Where its page is opened on this machine."""
    host = server.get_host()
    return f"http://{LOOPBACK[0] if host in EVERYWHERE else host}:{server.get_port()}"


def session_link(server: viser.ViserServer, name: str) -> str:
    """A link that opens the page with this session, and with no other."""
    return f"{page_address(server)}/?{urlencode({SESSION: name})}"


def stop_server(server: viser.ViserServer) -> None:
    """Stop it, and wait for its thread."""
    server.stop()
    thread = server._websock_server._server_thread
    if thread is not None:
        thread.join(5.0)


def _session_of(path: str) -> str:
    """The session that a link asks for; empty if it leaves that open."""
    return parse_qs(urlsplit(path).query).get(SESSION, [""])[0]


def _elsewhere(wanted: str, here: str) -> str:
    return (
        f"This link is to the session '{wanted[:200]}'; the workbench at this address shows '{here}'.\n"
        f"Open the other one with: workbench serve --session recordings/{wanted[:200]}\n"
    )


def _is_ours(request, host: str, port: int) -> bool:
    """One Host, which is this server; no Origin (a page being opened) or the same one."""
    try:
        hosts = request.headers.get_all("Host")
        origins = request.headers.get_all("Origin")
        if len(hosts) != 1 or not _names_us(hosts[0], host, port) or len(origins) > 1:
            return False
        if not origins:
            return True
        origin = urlsplit(origins[0].lower())
        return origin.scheme == "http" and _names_us(origin.netloc, host, port)
    except Exception:  # whatever is wrong with the request, it is not ours
        return False


def _names_us(name: str, host: str, port: int) -> bool:
    """Whether `name:port` is this server.

    Where it listens at every address, any address will do, but no other name than localhost: a foreign
    name that resolves to this machine is how a foreign page would get in.
    """
    parts = urlsplit(f"//{name.lower()}")
    if parts.port != port or parts.hostname is None:
        return False
    if parts.hostname in (*LOOPBACK, host.lower()):
        return True
    return host in EVERYWHERE and _is_address(parts.hostname)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True

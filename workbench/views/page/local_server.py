"""A viser server for this machine only.

viser itself checks neither Host nor Origin, so any page open in the user's browser could read and control the
scene, and every client may open a public tunnel. Here a request must name this server as its host and come
from one of its own pages, the page can't be framed, and the tunnel's handlers are removed. Programs on this
machine that send no Origin can still connect: this is no login. A server that other machines can reach asks
for a secret as well, which is in the link that the program prints and then in a cookie. It relies on
`viser_internals`; a test holds them.
"""

import asyncio
import hmac
import ipaddress
import logging
import secrets
import socket
import warnings
from collections.abc import Callable
from functools import partial
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlencode, urlsplit

import viser
import websockets.asyncio.server as websockets

from workbench.base.errors import OptionError
from workbench.views.page.style import configure_pages
from workbench.views.page.viser_internals import served_by, set_by_its_own_thread, stop_server, without_tunnel

PORT = 8090
"""Default port, tried first."""
LOOPBACK = ("127.0.0.1", "localhost")
LABEL = "Workbench"
KEY = "key"
"""What names the secret in a link."""
HEADERS = {
    "X-Frame-Options": "DENY",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}
"""No page shows this one in a frame, and none learns its link."""
FRAMES = ("iframe", "frame", "embed", "object")
EVERYWHERE = ("0.0.0.0", "::")


class LocalServer(viser.ViserServer):
    """A server with the secret that its pages must know; empty where only this machine can reach it.

    Attributes:
        message_path: How addresses begin by which its pages send messages.
        heard: Called with the message of a page, by the server's thread.
    """

    key = ""
    message_path = ""
    heard: Callable[[str], None] = staticmethod(lambda text: None)


def local_server(*, host: str = "127.0.0.1", port: int = 0) -> LocalServer:
    """A server that accepts requests from its own pages only.

    Args:
        host: Address to listen at; the loopback address unless the user asks for another one.
        port: Port, or 0 for any free one.
    """
    if not 0 <= port < 65536:
        raise OptionError(f"port {port} can't be used; give a number from 1 to 65535, or 0 for any free one")
    real = websockets.serve
    is_local = host.lower() == "localhost" or (_is_address(host) and ipaddress.ip_address(host).is_loopback)
    key = "" if is_local else secrets.token_urlsafe(16)
    message_path = f"/messages/{secrets.token_urlsafe(8)}/"

    # a page may come before the constructor has ended, but none that knows how to tell something
    def serve(handler, address, port_tried, *, process_request, **options):
        log = logging.Logger("workbench.page", logging.CRITICAL)  # anybody may send what is no request
        asyncio.get_running_loop().set_exception_handler(lambda loop, found: log.error(found["message"]))

        def guard(connection, request):
            if not _is_own_request(request, host, connection.local_address[1]):
                return connection.respond(403, "this page is not allowed to access the workbench\n")
            if key and not _knows(request, key):
                return connection.respond(403, "open the link that the workbench printed at start-up\n")
            if request.path.startswith(message_path):
                server.heard(request.path.removeprefix(message_path))
                response = connection.respond(204, "")
                response.headers["Cache-Control"] = "no-store"
                return response
            response = process_request(connection, request)
            if response is not None:
                response.headers.update(HEADERS)
                if key:
                    cookie = f"{_cookie(request)}={key}; HttpOnly; SameSite=Strict; Path=/"
                    response.headers["Set-Cookie"] = cookie
            return response

        options["logger"] = log
        return real(handler, address, port_tried, process_request=guard, **options)

    warnings.filterwarnings("ignore", r"\[viser\] .* does not match annotation")  # of a message
    with served_by(serve):
        server = LocalServer(host=host, port=port, label=LABEL, verbose=False)
    set_by_its_own_thread(server)
    configure_pages(server)
    server.key, server.message_path = key, message_path
    if port and server.get_port() != port:
        stop_server(server)
        raise OptionError(
            f"port {port} is taken by another program; choose another one with --port",
            option="--port",
            found=port,
        )
    without_tunnel(server)
    return server


def bound(host: str, port: int | None) -> viser.ViserServer:
    """A server at a port; at the usual one, or any free one where that is taken, if None."""
    bind = partial(local_server, host=host)
    if port is not None:
        return bind(port=port)
    try:
        return bind(port=PORT)
    except OptionError:
        return bind(port=0)


def page_address(server: viser.ViserServer) -> str:
    """Where its page is opened, by other machines too if they can reach it; with the secret if it has one."""
    host = server.get_host()
    if host in EVERYWHERE:
        host = _own_address()
    address = f"http://{f'[{host}]' if ':' in host else host}:{server.get_port()}"
    is_open = isinstance(server, LocalServer) and server.key
    return f"{address}/?{urlencode({KEY: server.key})}" if is_open else address


def _own_address() -> str:
    """The address by which other machines reach this one; nothing is sent to find out."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
            return probe.getsockname()[0]
        except OSError:  # no network
            return LOOPBACK[0]


def _cookie(request) -> str:
    """Name of the cookie with the secret: other servers of this machine have theirs."""
    return f"workbench-{urlsplit('//' + request.headers['Host']).port}"


def _knows(request, key: str) -> bool:
    """Whether a request has the secret, in its link or in its cookie."""
    given = parse_qs(urlsplit(request.path).query).get(KEY, [])
    try:
        cookies = SimpleCookie(request.headers.get("Cookie", ""))
    except CookieError:
        cookies = SimpleCookie()
    if (kept := cookies.get(_cookie(request))) is not None:
        given.append(kept.value)
    return any(hmac.compare_digest(word.encode(), key.encode()) for word in given)


def _is_own_request(request, host: str, port: int) -> bool:
    """One Host, which is this server; no Origin (a page being opened) or the same one; no frame of others."""
    try:
        fetched = (request.headers.get("Sec-Fetch-Site"), request.headers.get("Sec-Fetch-Dest"))
        if fetched[0] == "cross-site" and fetched[1] in FRAMES:
            return False
        hosts = request.headers.get_all("Host")
        origins = request.headers.get_all("Origin")
        if len(hosts) != 1 or not _is_own_address(hosts[0], host, port) or len(origins) > 1:
            return False
        if not origins:
            return True
        origin = urlsplit(origins[0].lower())
        is_same = origin.netloc == hosts[0].lower() or (
            origin.hostname in LOOPBACK and urlsplit(f"//{hosts[0].lower()}").hostname in LOOPBACK
        )
        return origin.scheme == "http" and is_same and _is_own_address(origin.netloc, host, port)
    except Exception:  # whatever is wrong with the request, it is not ours
        return False


def _is_own_address(name: str, host: str, port: int) -> bool:
    """Whether `name:port` is this server.

    Where it listens at every address, any address will do, but no other name than localhost: a foreign
    name that resolves to this machine is how a foreign page would get in.
    """
    parts = urlsplit(f"//{name.lower()}")
    if parts.port != port or parts.hostname is None or parts.username is not None:
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

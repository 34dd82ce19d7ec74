"""Everything that relies on private parts of viser, in the versions that `pyproject.toml` allows."""

import contextlib
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import rich
import viser
import websockets.asyncio.server as websockets
from viser import _icons, _messages
from viser.infra._async_message_buffer import AsyncMessageBuffer

HANDED_OVER = 0.01
"""Maximum wait for viser's thread to take messages [s]; a page on a slow line takes them later."""


@contextlib.contextmanager
def replaced(owner: Any, name: str, value: Any) -> Iterator[None]:
    """Another value of an attribute within the block."""
    before = getattr(owner, name)
    setattr(owner, name, value)
    try:
        yield
    finally:
        setattr(owner, name, before)


@contextlib.contextmanager
def icons_at_once() -> Iterator[None]:
    """Buttons made within this find the archive open; viser opens it again for every icon, 25 ms each."""
    with zipfile.ZipFile(_icons.ICONS_DIR / "tabler-icons.zip") as archive:
        opened = SimpleNamespace(ZipFile=lambda path: contextlib.nullcontext(archive))
        with replaced(_icons, "zipfile", opened):
            yield


@contextlib.contextmanager
def served_by(serve: Callable[..., Any]) -> Iterator[None]:
    """Servers made within this are served by `serve`, in silence.

    viser looks `websockets.serve` up when its thread starts, which is inside its constructor; what it prints
    there names no page that one should open.
    """
    with replaced(websockets, "serve", serve), replaced(rich.get_console(), "quiet", True):
        yield


def without_tunnel(server: viser.ViserServer) -> None:
    """Remove what lets any page open a public tunnel."""
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)


def set_by_its_own_thread(server: viser.ViserServer) -> None:
    """Viser tells its loop of a message twice: from whatever thread the message comes, and by the loop.

    The first may meet the loop's own clients coming and going, and then fails what was being drawn. What is
    for every page waits in one buffer, what is for one page in its own.
    """
    sockets = server._websock_server

    def cure(buffer: AsyncMessageBuffer) -> None:
        wake = buffer.message_event.set

        def set_() -> None:
            if threading.current_thread() is sockets._server_thread:
                wake()

        buffer.message_event.set = set_  # type: ignore[method-assign]

    sockets.on_client_connect(lambda client: cure(client.get_message_buffer()))
    cure(sockets._broadcast_buffer)
    for page in tuple(sockets._client_state_from_id.values()):  # which came before the constructor's end
        cure(page.message_buffer)


def hand_over(server: viser.ViserServer) -> None:
    """Send what waits for all pages, and let viser's thread take it before anything else is queued.

    A block of messages that begins at once would hold it up until that block ends.
    """
    buffer = server._websock_server._broadcast_buffer
    last, end = buffer.message_counter - 1, time.monotonic() + HANDED_OVER
    server.flush()
    while time.monotonic() < end and any(taken < last for taken in tuple(buffer.generator_cursors.values())):
        time.sleep(1e-4)


def stop_server(server: viser.ViserServer) -> None:
    """Stop it, and wait for its thread, which says goodbye to nobody."""
    with replaced(rich.get_console(), "quiet", True):
        server.stop()
        thread = server._websock_server._server_thread
        if thread is not None:
            thread.join(5.0)


def run_script(gui: viser.GuiApi, script: str) -> None:
    """Run JavaScript on a client's page; with a server's interface on every page, also on later ones."""
    gui._websock_interface.queue_message(_messages.RunJavascriptMessage(script))


def limit_upload(gui: viser.GuiApi, button: viser.GuiUploadButtonHandle, maximum: int, address: str) -> None:
    """Let pages send no file of more bytes by this button; they ask for this address instead."""
    run_script(gui, f"(window.limits ??= {{}})[{button._impl.uuid!r}] = [{maximum}, {address!r}];")


def forget_uploads(gui: viser.GuiApi) -> None:
    """Pages that are opened later would show files as coming that came before; viser keeps it for them."""
    buffer = getattr(gui._websock_interface, "_broadcast_buffer", None)
    if buffer is not None:  # of what is for every page
        buffer.remove_from_buffer(lambda message: isinstance(message, _messages.FileTransferPartAck))


def set_value(control: Any, value: Any) -> None:
    """Show a value; nothing is sent if the control has it already.

    viser would wake its event loop for every callback of the control, which are for users' changes alone.
    """
    state = control._impl
    value = type(state.value)(value)
    if state.value != value:
        new = _messages.GuiUpdateMessage(state.uuid, {"value": value})
        state.gui_api._websock_interface.queue_message(new)
        state.value = value


def set_pose(node: viser.SceneNodeHandle, position: Any = None, wxyz: Any = None) -> None:
    """Move or turn a node on all pages, also where the server has it there already.

    viser sends no pose that it has, nor the default one of a new node, which a page may show where an older
    node of its name stood; and its comparison takes longer than all else in a drag.
    """
    state = node._impl
    if position is not None:
        state.position[:] = position
        x, y, z = state.position.tolist()
        state.api._queue_scene_message(_messages.SetPositionMessage(state.name, (x, y, z)))
    if wxyz is not None:
        state.wxyz[:] = wxyz
        w, x, y, z = state.wxyz.tolist()
        state.api._queue_scene_message(_messages.SetOrientationMessage(state.name, (w, x, y, z)))

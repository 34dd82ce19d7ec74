"""The app: a session, its worker, and a page that shows it; from Python alongside a notebook or script."""

import webbrowser
from collections.abc import Callable, Iterable
from contextvars import copy_context
from functools import partial
from typing import final

import viser

from workbench.arm.robot import Robot
from workbench.base.arguments import checked_arguments
from workbench.base.errors import OptionError
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.identification.meaning.as_read import with_own_columns
from workbench.plate.arguments import PlateLike
from workbench.plate.plate import Plate
from workbench.session.commands.data import load_command, matched_to_arm, with_data
from workbench.session.commands.messages import OpenTab
from workbench.session.commands.region import CHORES
from workbench.session.journal.folder import StartedSession, unrecorded_session
from workbench.session.loaded_measurements import Loaded, facts_of
from workbench.session.page_state import Tab
from workbench.session.start import default_circle, start
from workbench.session.state import Session
from workbench.session.view import AbstractView
from workbench.session.worker import Worker
from workbench.views.page.demo import Demo
from workbench.views.page.local_server import bound, local_server, page_address
from workbench.views.page.render import BrowserView
from workbench.views.page.viser_internals import stop_server


class App:
    """A running app.

    Args:
        robot: Nominal robot.
        plate: Fixture with its targets.
        data: Name and contents of a measurement file to begin with.
        server: Where the page is shown; None for one of its own at any free port.
        begun: The session and what follows it, such as a recording; None for a new one, not recorded.
        demo: Pace of the demo that plays as the first page opens, 1 for two minutes; None: no demo.
        beside: Make more views with the worker, or see to something else.
        asks: Whether a card asks first what the user has, unless a session is reopened.
    """

    def __init__(
        self,
        robot: Robot,
        plate: Plate,
        *,
        data: tuple[str, bytes] | None = None,
        server: viser.ViserServer | None = None,
        begun: StartedSession | None = None,
        demo: float | None = None,
        beside: Iterable[Callable[[Worker], AbstractView | None]] = (),
        asks: bool = False,
    ):
        begun = unrecorded_session(robot, plate) if begun is None else begun
        self.server = local_server() if server is None else server
        self.worker = Worker(
            begun.session, keepers=begun.keepers, journal=begun.entries, opening=begun.opening
        )
        asks = asks and not begun.entries
        self.demo: Demo | None = None
        make_view = partial(BrowserView, self.server, self.worker, show_demo=self.play_demo, asks=asks)
        self.view = copy_context().run(make_view)  # which speaks to the page, as the caller need not
        self.worker.add_view(self.view)
        self.worker.begin_chores(CHORES)  # not while the page is made: both would take longer
        for make in beside:
            if (view := make(self.worker)) is not None:
                self.worker.add_view(view)
        if data is not None:
            self.worker.submit(load_command(*data))
            self.worker.submit(OpenTab(Tab.CALIBRATE))
        if demo is not None:  # once somebody sees it

            @self.server.on_client_connect
            def _(_: viser.ClientHandle) -> None:
                if self.demo is None:
                    self.play_demo(demo)

    def play_demo(self, pace: float = 1.0) -> None:
        """Play the demo, 1 for two minutes."""
        self.demo = Demo(self.worker, pace=pace)

    @property
    def url(self) -> str:
        """Address of the page."""
        return page_address(self.server)

    def close(self) -> None:
        """Stop the demo, the worker and the server."""
        if self.demo is not None:
            self.demo.stop()
        self.worker.close()
        stop_server(self.server)


@final
class Page:
    """A page that is being served; it ends with `stop`, or with the program."""

    def __init__(self, app: App):
        self._app: App | None = app
        self.url = app.url

    @property
    def session(self) -> Session:
        """What the page shows now."""
        if self._app is None:
            raise OptionError("the page was stopped; call show again")
        return self._app.worker.session

    def stop(self) -> None:
        """Stop serving; a second call does nothing."""
        app, self._app = self._app, None
        if app is not None:
            app.close()


@checked_arguments()
def show(
    robot: RobotLike,
    data: DatasetLike | None = None,
    plate: PlateLike | None = None,
    *,
    port: int | None = None,
    open_browser: bool = True,
) -> Page:
    """Open the page on a robot, its measurements and a plate; nothing is recorded.

    Only this machine can reach it.

    Args:
        robot: The arm, nominal or calibrated.
        data: Its measurements; none if None.
        plate: A plate; a circle of targets in front of the arm if None.
        port: Port; 8090, or any free one where that is taken, if None.
        open_browser: Whether to open the page in the user's browser.

    Returns:
        The page, with its `url` and `stop()`.

    Raises:
        OptionError: the port is taken, or the plate has no targets.
        ShapeError: the measurements are of an arm with another number of joints.
        DataError: measurements that this arm can't have made.
    """
    session = start(robot, default_circle(robot) if plate is None else plate, is_given=plate is not None)
    if data is not None:
        data = with_own_columns(robot, data)
        robot.check_joints(data.q, data.source)
        loaded = Loaded(data, data.source, facts_of(data), read=data)
        session = with_data(session, matched_to_arm(robot, loaded))
    page = Page(App(robot, session.plate, begun=StartedSession(session), server=bound("127.0.0.1", port)))
    if open_browser:
        webbrowser.open(page.url)
    return page

"""The page from Python: one robot, its measurements and a plate, alongside a notebook or script."""

import webbrowser
from typing import final

from workbench.base.arguments import checked_arguments
from workbench.base.errors import OptionError
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.identification.meaning.as_read import with_own_columns
from workbench.plate.arguments import PlateLike
from workbench.session.commands.data import matched_to_arm, with_data
from workbench.session.journal.folder import StartedSession
from workbench.session.loaded_measurements import Loaded, facts_of
from workbench.session.start import default_circle, start
from workbench.session.state import Session
from workbench.views.page.app import App
from workbench.views.page.serve import bound


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

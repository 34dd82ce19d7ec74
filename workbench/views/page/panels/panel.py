"""What a panel is."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import viser

from workbench.session.state import Session


class AbstractPanel(ABC):
    """Controls on the page. `build` makes them once; afterwards only `show` changes them."""

    @abstractmethod
    def build(self, server: viser.ViserServer) -> None:
        """Make the controls in the present container; their callbacks only send commands."""

    @abstractmethod
    def show(self, session: Session) -> None:
        """Bring the controls in line with this snapshot."""


def set_value(control: Any, value: Any) -> None:
    """Show a value; nothing is sent if the control has it already."""
    control.value = value


def set_options(control: Any, options: list[str], value: str) -> None:
    """Show these options with one of them chosen; nothing is sent if nothing has changed."""
    if list(control.options) != options:
        control.options = options
    set_value(control, value)


def on_choice(buttons: Any, actions: dict[str, Callable[[], None]]) -> None:
    """Call the action of the button that a user presses in a group."""

    @buttons.on_click
    async def _(event: viser.GuiEvent) -> None:
        actions[event.target.value]()


def on_change(control: Any, action: Callable[[], None]) -> None:
    """Call the action when a user changes the control, not when the program does."""

    @control.on_update
    async def _(event: viser.GuiEvent) -> None:
        if event.client_id is not None:
            action()


def on_press(button: Any, action: Callable[[], None]) -> None:
    """Call the action when a user presses the button."""

    @button.on_click
    async def _(event: viser.GuiEvent) -> None:
        action()

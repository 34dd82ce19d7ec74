"""Controls of a panel, each described once: what it shows of the session, when it is there, what it sends.

    noise = (
        self.number("Noise [mm]", (0.001, 10.0, 0.001), hint, lambda s: s.noise.position, unit=1e-3),
        self.number("Noise [°]", (0.001, 5.0, 0.001), hint, lambda s: s.noise.rotation, unit=DEGREE),
    )
    self.form(SetNoise, *noise)

Panels bring all controls in line with every snapshot that they draw; SI inside, units on the page.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, final

import numpy as np
import viser

from workbench.base.errors import WorkbenchError
from workbench.session.command import AbstractCommand
from workbench.session.commands.messages import Tell
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.page.viser_internals import set_value

DEGREE = float(np.deg2rad(1.0))
DECIMALS = 3
"""Digits that fields keep behind the point of what is typed, at least."""
SHOWN_DIGITS = 6
"""Decimal places to which a number in its unit is shown: conversion leaves more."""
Shown = Callable[[Session], Any]
"""What something shows of a session."""
Commands = Mapping[str, Callable[[], AbstractCommand | None]]
"""What buttons send, by their labels."""
Limits = tuple[float, float, float]
"""Minimum, maximum, and what an arrow key adds, in the unit of the control."""


class AbstractControl(ABC):
    """A control of a panel.

    Args:
        control: viser's handle.
        visible: When it is there; None: always. Whether it is there at first, if the panel itself decides.
        disabled: When it can't be used.
    """

    def __init__(self, control: Any, *, visible: Shown | bool | None = None, disabled: Shown | None = None):
        self.control = control
        self._visible, self._disabled = None if isinstance(visible, bool) else visible, disabled
        if isinstance(visible, bool):
            control.visible = visible

    @property
    @abstractmethod
    def typed(self) -> Any:
        """What stands there, as commands take it."""

    @abstractmethod
    def show_value(self, session: Session) -> None:
        """Bring what stands there in line with a snapshot."""

    def show(self, session: Session) -> None:
        """Bring the control in line with a snapshot."""
        if self._visible is not None:
            self.control.visible = bool(self._visible(session))
        if self._disabled is not None:
            self.control.disabled = bool(self._disabled(session))
        self.show_value(session)


@final
class ValueControl(AbstractControl):
    """A number, a switch or a text.

    Args:
        shows: The session's value for it; None where only the user changes it, or where it has none.
        to_page: The control's value for that of the session.
        typed: The session's value for that of the control.
    """

    def __init__(
        self,
        control: Any,
        shows: Shown | None = None,
        *,
        to_page: Callable[[Any], Any] = lambda value: value,
        typed: Callable[[Any], Any] = lambda value: value,
        **when: Any,
    ):
        super().__init__(control, **when)
        self._shows, self._to_page, self._typed = shows, to_page, typed

    @property
    def typed(self) -> Any:
        return self._typed(self.control.value)

    def show_value(self, session: Session) -> None:
        if self._shows is not None:
            set_value(self.control, self._to_page(self._shows(session)))


@final
class Dropdown(AbstractControl):
    """One of several, by what they are called on the page; which there are may depend on the session."""

    def __init__(self, control: Any, shows: Shown | None, options: Shown, **when: Any):
        super().__init__(control, **when)
        self._shows, self._of, self._options = shows, options, dict[str, Any]()

    @property
    def typed(self) -> Any:
        return self._options.get(self.control.value)

    def show_value(self, session: Session) -> None:
        self._options = dict(self._of(session))
        show_options(self.control, list(self._options))
        if self._shows is not None:
            value = self._shows(session)
            name = next((name for name, option in self._options.items() if option == value), None)
            set_value(self.control, self.control.value if name is None else name)


@final
class Html(AbstractControl):
    """What is said of a session; not there while that is nothing."""

    def __init__(self, control: Any, shows: Shown):
        super().__init__(control)
        self._shows = shows

    @property
    def typed(self) -> str:
        return str(self.control.content)

    def show_value(self, session: Session) -> None:
        self.control.content = content = self._shows(session)
        self.control.visible = bool(content)


AnyControl = TypeVar("AnyControl", bound=AbstractControl)


class AbstractControls(ABC):
    """Makes controls; `show_fields` brings all of them in line with a snapshot."""

    _gui: viser.GuiApi

    def __init__(self, worker: Worker):
        self._worker = worker
        self._controls: list[AbstractControl] = []

    def show_fields(self, session: Session) -> None:
        for field in self._controls:
            field.show(session)

    def add(self, field: AnyControl) -> AnyControl:
        """Keep a control in line with the session."""
        self._controls.append(field)
        return field

    def number(
        self,
        label: str,
        limits: Limits,
        hint: str,
        shows: Shown | None = None,
        *,
        unit: float = 1.0,
        **more: Any,
    ) -> ValueControl:
        """A field for a number, shown in its unit [SI]; `more` as for it, and `value` to begin with."""
        minimum, maximum, step = limits
        value = more.pop("value", None)
        first = self._first(shows, unit, limits) if value is None else value
        made = self._gui.add_number(label, first, min=minimum, max=maximum, step=step, hint=hint)
        if isinstance(step, float):
            made.precision = max(made.precision, DECIMALS)
        return self.add(_numeric(made, shows, unit, **more))

    def slider(
        self,
        label: str,
        limits: Limits,
        hint: str,
        shows: Shown | None = None,
        *,
        unit: float = 1.0,
        **more: Any,
    ) -> ValueControl:
        """The same as a slider."""
        value = more.pop("value", None)
        first = self._first(shows, unit, limits) if value is None else value
        made = self._gui.add_slider(label, *limits, first, hint=hint)
        return self.add(_numeric(made, shows, unit, **more))

    def checkbox(
        self, label: str, hint: str, shows: Shown | None = None, *, value: bool = False, **more: Any
    ) -> ValueControl:
        made = self._gui.add_checkbox(label, value, hint=hint)
        return self.add(ValueControl(made, shows, typed=bool, **more))

    def dropdown(
        self,
        label: str,
        options: Mapping[str, Any] | Shown,
        hint: str,
        shows: Shown | None = None,
        **more: Any,
    ) -> Dropdown:
        """One of several values, by their names; a function of the session if it decides which there are."""
        of = options if callable(options) else lambda session: options
        made = self._gui.add_dropdown(label, tuple(of(self._worker.session)), hint=hint)
        return self.add(Dropdown(made, shows, of, **more))

    def line(self, label: str, hint: str, shows: Shown | None = None, **more: Any) -> ValueControl:
        """A line of text to type."""
        return self.add(ValueControl(self._gui.add_text(label, "", hint=hint), shows, **more))

    def folder(
        self, label: str, *, is_open: bool = True, **when: Shown | bool | None
    ) -> viser.GuiFolderHandle:
        made = self._gui.add_folder(label, expand_by_default=is_open)
        self.add(ValueControl(made, **when))  # type: ignore[arg-type]
        return made

    def html(self, shows: Shown) -> Html:
        """What a function of the session says; not there while that is nothing."""
        return self.add(Html(self._gui.add_html("", visible=False), shows))

    def button(
        self,
        label: str,
        do: Callable[[], AbstractCommand | None],
        icon: viser.IconName,
        hint: str,
        *,
        main: bool = False,
        **when: Shown | bool | None,
    ) -> viser.GuiButtonHandle:
        """A button that sends the command that `do` gives, if any; coloured if it is its panel's main one."""
        made = self._gui.add_button(label, icon=icon, hint=hint, color=None if main else "gray")
        on_press(made, lambda: self.send(do))
        self.add(ValueControl(made, **when))  # type: ignore[arg-type]
        return made

    def press(
        self,
        label: str,
        do: Callable[[viser.GuiEvent], None],
        icon: viser.IconName,
        hint: str,
        **when: Shown | bool | None,
    ) -> viser.GuiButtonHandle:
        """A button that does something on the page of the user who presses it."""
        made = self._gui.add_button(label, icon=icon, hint=hint, color="gray")
        made.on_click(do)
        self.add(ValueControl(made, **when))  # type: ignore[arg-type]
        return made

    def buttons(
        self, label: str, commands: Commands, hint: str, **when: Shown | bool | None
    ) -> viser.GuiButtonGroupHandle:
        """A group of buttons, each with the command that it sends."""
        made = self._gui.add_button_group(label, tuple(commands), hint=hint)

        @made.on_click
        async def _(event: viser.GuiEvent) -> None:
            self.send(commands[event.target.value])

        self.add(ValueControl(made, **when))  # type: ignore[arg-type]
        return made

    def form(self, command: Callable[..., AbstractCommand | None], *fields: AbstractControl) -> None:
        """Send a command of what stands in the fields whenever a user changes one of them."""
        for field in fields:
            self.sends(field, lambda: command(*(each.typed for each in fields)))

    def sends(self, field: AbstractControl | Any, make: Callable[[], AbstractCommand | None]) -> None:
        """Send the command that `make` gives, if any, whenever a user changes the control."""
        control = field.control if isinstance(field, AbstractControl) else field
        on_change(control, lambda: self.send(make))

    def send(self, make: Callable[[], AbstractCommand | None]) -> None:
        """Send the command that `make` gives, if any; what was typed wrong is shown as a message."""
        try:
            command = make()
        except WorkbenchError as error:
            command = Tell(str(error))
        if command is not None:
            self._worker.submit(command)

    def _first(self, shows: Shown | None, unit: float, limits: Limits) -> float:
        """What a number begins with; of the type of its step."""
        value = limits[0] if shows is None else shows(self._worker.session) / unit
        return type(limits[2])(min(max(value, limits[0]), limits[1]))


def _numeric(
    control: Any, shows: Shown | None, unit: float, *, digits: int = SHOWN_DIGITS, **more: Any
) -> ValueControl:
    kind = type(control.value)
    return ValueControl(
        control,
        shows,
        to_page=lambda value: kind(round(float(value) / unit, digits)),
        typed=(lambda value: unit * float(value)) if kind is float or unit != 1.0 else int,
        **more,
    )


def show_options(control: Any, options: list[str]) -> None:
    """Offer these options; nothing is sent if they are there already."""
    if list(control.options) != options:
        control.options = options


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

"""Controls of a panel, each described once: what it shows of the session, when it is there, what it sends.

    noise = (
        self.number("Noise [mm]", (0.001, 10.0, 0.001), hint, lambda s: s.noise.position, unit=1e-3),
        self.number("Noise [°]", (0.001, 5.0, 0.001), hint, lambda s: s.noise.rotation, unit=DEGREE),
    )
    self.form(SetNoise, *noise)

What else depends on the session is given by viser's names: `visible`, `disabled`, `label`, `color`, `max`.
Panels bring all controls in line with every snapshot that they draw; SI inside, units on the page.
"""

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, final

import numpy as np
import viser

from workbench.base.errors import WorkbenchError
from workbench.session.command import AbstractCommand
from workbench.session.commands.compare import SetOverlay
from workbench.session.commands.messages import Tell
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.page.html import block, text
from workbench.views.page.viser_internals import set_value

DEGREE = float(np.deg2rad(1.0))
DECIMALS = 3
"""Digits that fields keep behind the point of what is typed, at least."""
SHOWN_DIGITS = 6
"""Decimal places to which a number in its unit is shown: conversion leaves more."""
Shown = Callable[[Session], Any]
"""What something shows of a session."""
Press = Callable[[Any], Any]
"""What is done on the page of the user who presses; a plain function may take its time."""
Make = Callable[[], AbstractCommand | None]
"""Makes the command that is sent, if any."""
Icon = viser.IconName | None
Options = Mapping[str, Any] | Iterable[str]
"""Values by what they are called, or names that stand for themselves."""
Limits = tuple[float, float, float]
"""Minimum, maximum, and what an arrow key adds, in the unit of the control."""


class ShownUnit(NamedTuple):
    """A unit of three numbers: its size in SI, and decimal places that are shown."""

    name: str
    size: float
    places: int


LENGTH, ANGLE = ShownUnit("mm", 1e-3, 2), ShownUnit("°", DEGREE, 3)


@final
class Control:
    """A control of a panel.

    Args:
        control: viser's handle.
        typed: What stands there, as commands take it, from the control's value.
        shows: The control's attributes for a session, by viser's names, in this order; those after `visible`
            only while it is there. None: as it is.
    """

    def __init__(
        self, control: Any, typed: Callable[[Any], Any] = lambda value: value, **shows: Shown | None
    ):
        self.control, self._typed = control, typed
        self._shows = {name: find for name, find in shows.items() if find is not None}

    @property
    def typed(self) -> Any:
        return self._typed(self.control.value)

    def show(self, session: Session) -> None:
        """Bring the control in line with a snapshot."""
        for name, find in self._shows.items():
            shown = bool(find(session)) if name in ("visible", "disabled") else find(session)
            if name == "value":
                set_value(self.control, shown)
            elif getattr(self.control, name) != shown:
                setattr(self.control, name, shown)
            if name == "visible" and not shown:
                return


class AbstractControls:
    """Makes controls; `show_fields` brings all of them in line with a snapshot.

    Each takes the attributes of `Control` besides.
    """

    _gui: viser.GuiApi

    def __init__(self, worker: Worker):
        self._worker = worker
        self._controls: list[Control] = []

    @property
    def session(self) -> Session:
        return self._worker.session

    def overlaid(self, **changes: Any) -> SetOverlay:
        """What lays other things over the scene."""
        return SetOverlay(replace(self.session.choices.overlay, **changes))

    def show_fields(self, session: Session) -> None:
        for field in self._controls:
            field.show(session)

    def add(self, field: Control) -> Control:
        """Keep a control in line with the session."""
        self._controls.append(field)
        return field

    def number(
        self, label: str, /, limits: Limits, hint: str, shows: Shown | None = None, **more: Any
    ) -> Control:
        """A field for a number, shown in its `unit` [SI], to so many `digits`; `value` to begin with."""
        low, high, step = limits
        made = self._gui.add_number(label, low, min=low, max=high, step=step, hint=hint)
        if isinstance(step, float):
            made.precision = max(made.precision, DECIMALS)
        return self._numeric(made, shows, **more)

    def slider(
        self, label: str, /, limits: Limits, hint: str, shows: Shown | None = None, **more: Any
    ) -> Control:
        """The same as a slider."""
        return self._numeric(self._gui.add_slider(label, *limits, limits[0], hint=hint), shows, **more)

    def _numeric(
        self,
        made: Any,
        shows: Shown | None,
        *,
        unit: float = 1.0,
        digits: int = SHOWN_DIGITS,
        value: float | None = None,
        **more: Shown,
    ) -> Control:
        kind = type(made.value)
        if value is not None:
            set_value(made, value)
        in_unit = shows and (lambda session: kind(round(float(shows(session)) / unit, digits)))
        typed = int if kind is int and unit == 1.0 else lambda value: unit * float(value)
        return self.add(Control(made, typed, **more, value=in_unit))

    def coordinates(self, title: str, unit: ShownUnit, hint: str, shows: Shown, **more: Shown) -> Control:
        """Three numbers [SI], shown in a unit; those not touched keep all their digits."""

        def shown(session: Session) -> tuple[float, ...]:
            return tuple((np.round(np.array(shows(session)) / unit.size, unit.places) + 0.0).tolist())

        def typed(value: tuple[float, ...]) -> tuple[float, ...]:
            session = self._worker.session
            each = zip(value, shown(session), shows(session), strict=True)
            return tuple(float(old if new == was else unit.size * new) for new, was, old in each)

        made = self._gui.add_vector3(f"{title} [{unit.name}]", (0.0, 0.0, 0.0), step=1.0, hint=hint)
        made.precision = unit.places
        return self.add(Control(made, typed, **more, value=shown))

    def checkbox(
        self, label: str, /, hint: str, shows: Shown | None = None, *, value: bool = False, **more: Shown
    ) -> Control:
        return self.add(Control(self._gui.add_checkbox(label, value, hint=hint), bool, **more, value=shows))

    def dropdown(
        self, label: str, /, options: Options | Shown, hint: str, shows: Shown | None = None, **more: Shown
    ) -> Control:
        """One of several values, by their names; a function of the session if it decides which there are."""
        known = dict[str, Any]()

        def names(session: Session) -> tuple[str, ...]:
            nonlocal known
            found = options(session) if callable(options) else options
            known = dict(found) if isinstance(found, Mapping) else {name: name for name in found}
            return tuple(known)

        def name(session: Session) -> str:
            value = None if shows is None else shows(session)
            return next((name for name, option in known.items() if option == value), made.value)

        made = self._gui.add_dropdown(label, names(self._worker.session), hint=hint)
        depends = {"options": names if callable(options) else None, "value": name if shows else None}
        return self.add(Control(made, lambda name: known.get(name), **more, **depends))

    def line(self, label: str, /, hint: str, *, multiline: bool = False, **more: Shown) -> Control:
        """A line of text to type, or several."""
        return self.add(Control(self._gui.add_text(label, "", hint=hint, multiline=multiline), **more))

    def folder(self, label: str, /, *, is_open: bool = True, **more: Shown) -> viser.GuiFolderHandle:
        return self.add(Control(self._gui.add_folder(label, expand_by_default=is_open), **more)).control

    def html(self, shows: Shown) -> Control:
        """What a function of the session says; not there while that is nothing."""
        made = self._gui.add_html("", visible=False)
        return self.add(Control(made, content=shows, visible=lambda session: made.content))

    def press(
        self, label: str, /, do: Press, icon: Icon, hint: str, *, main: bool = False, **more: Shown
    ) -> viser.GuiButtonHandle:
        """A button that does something; coloured if it is its panel's main one."""
        made = self._gui.add_button(label, icon=icon, hint=hint, color=None if main else "gray")
        made.on_click(do)
        return self.add(Control(made, **more)).control

    def button(self, label: str, /, make: Make, icon: Icon, hint: str, **more: Any) -> viser.GuiButtonHandle:
        """A button that sends a command."""
        return self.press(label, self.sending(lambda event: make()), icon, hint, **more)

    def buttons(self, label: str, /, commands: Mapping[str, Make], hint: str, **more: Shown) -> None:
        """A group of buttons, each with the command that it sends."""
        send = self.sending(lambda event: commands[event.target.value]())
        self.press_one(label, commands, send, hint, **more)

    def press_one(self, label: str, /, names: Iterable[str], do: Press, hint: str, **more: Shown) -> None:
        """A group of buttons that do something, by the name of the one that is pressed."""
        made = self._gui.add_button_group(label, tuple(names), hint=hint)
        made.on_click(do)
        self.add(Control(made, **more))

    def sending(self, make: Callable[[Any], AbstractCommand | None]) -> Press:
        """What sends a command when viser tells of an event."""

        async def send(event: viser.GuiEvent) -> None:
            self.send(lambda: make(event), event)

        return send

    def form(self, command: Callable[..., AbstractCommand | None], *fields: Control) -> None:
        """Send a command of what stands in the fields whenever a user changes one of them."""
        for field in fields:
            self.sends(field, lambda: command(*(each.typed for each in fields)))

    def sends(self, field: Control, make: Make) -> None:
        """Send a command whenever a user changes the control."""
        on_change(field, lambda event: self.send(make, event))

    def send(self, make: Make, event: viser.GuiEvent | None = None) -> None:
        """Send a command; what was typed wrong is shown as a message.

        One that takes results away is sent once the user whose event it is has agreed.
        """
        try:
            command = make()
        except WorkbenchError as error:
            command = Tell(str(error))
        if command is None:
            return
        send = partial(self._worker.submit, command)
        with suppress(WorkbenchError):  # a file that can't be read: its refusal says so
            if event is not None and (lost := command.removes(self.session)):
                back = partial(self.show_fields, self.session)
                ask(event, "Remove the present measurements?", lost, command.title, send, otherwise=back)
                return
        send()


def on_change(field: Control, action: Callable[[viser.GuiEvent], object]) -> None:
    """Call the action when a user changes the control, not when the program does."""

    @field.control.on_update
    async def _(event: viser.GuiEvent) -> None:
        if event.client_id is not None:
            action(event)


def ask(
    event: viser.GuiEvent,
    title: str,
    question: str,
    label: str,
    do: Callable[[], object],
    *,
    otherwise: Callable[[], object] = lambda: None,
) -> None:
    """Do something once the user has said so, in a sheet over the page of the user who pressed a button.

    `title` says what is to be decided; `otherwise` takes a choice back.
    """
    if event.client is None:
        return
    gui = event.client.gui
    with (dialogue := gui.add_modal(title)):
        gui.add_html(block(text(question), testid="question", style="margin:4px 0 10px"))
        yes = gui.add_button(label, hint=question)
        no = gui.add_button("Cancel", color="gray", hint="Go back.")

    def close(action: Callable[[], object], _: object) -> None:
        dialogue.close()
        action()

    yes.on_click(partial(close, do))
    no.on_click(partial(close, otherwise))

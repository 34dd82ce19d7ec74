"""The palette (Ctrl K): every button and setting of the panels by name; its tab opens, and it is there."""

import json
from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from workbench.session.page_state import Tab
from workbench.views.page.viser_internals import run_script

SHOW = """(([id, word]) => {
  const folder = ".mantine-Paper-root[data-with-border]", start = Date.now();
  const look = () => {
    const label = document.querySelector(`label[for="${id}"]`);
    const all = word ? [...label?.closest(".mantine-Flex-root")?.querySelectorAll("button") ?? []] : [];
    const found = word ? all.find(b => b.innerText === word) : document.getElementById(id) ?? label;
    if (!found || document.querySelectorAll("[role=tab]").length < 2) {  // the tab is being opened
      if (Date.now() - start < 4000) setTimeout(look, 60);
      return;
    }
    for (let at = found.closest(folder); at; at = at.parentElement.closest(folder))
      if (!at.children[1].checkVisibility()) at.firstElementChild.click();
    setTimeout(() => {
      found.scrollIntoView({ block: "center" });
      if (found.matches("button") && !found.disabled) return found.click();
      const focus = () => document.activeElement === document.body &&
        (found.matches("input") ? found : found.querySelector("input, [role=slider]") ?? found).focus();
      document.activeElement?.blur();
      for (const wait of [0, 300, 900]) setTimeout(focus, wait);  // the palette gives its focus back
    }, 250);
  };
  setTimeout(look, 150);
})(%s)"""
"""JavaScript that waits for a control, opens the folders around it, presses a button, focuses a setting."""


def add_commands(
    gui: viser.GuiApi, tab: Tab, made: dict[str, Any], open_on: Callable[[viser.ClientHandle, Tab], None]
) -> None:
    """A command for each of the controls `made` in a tab, and for each button of a group."""

    def show(place: list[str], event: viser.CommandEvent) -> None:
        if event.client is not None:
            open_on(event.client, tab)
            run_script(event.client.gui, SHOW % json.dumps(place))

    for uuid, control in made.items():
        is_group = isinstance(control, viser.GuiButtonGroupHandle)
        for word in control.options if is_group else ("",):
            known = f"{tab} · {control.label}" if is_group else str(tab)
            hint = known if is_group or not control.hint else f"{known}: {control.hint}"
            command = gui.add_command(word or control.label, description=hint)
            command.on_trigger(partial(show, [uuid, word]))

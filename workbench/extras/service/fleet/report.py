"""A fleet as tables and as plain data: the schema `workbench.fleet/1`."""

from collections.abc import Callable

from rich.console import Group, RenderableType
from rich.text import Text

from workbench.base.wording import plural
from workbench.extras.service.fleet.movement import Law, Movement
from workbench.extras.service.fleet.result import ArmReport, Fleet
from workbench.report.json import Json, document
from workbench.report.result_display import summary_of
from workbench.report.result_fields import MM, ResultField, ResultFields
from workbench.report.tables import line

SCHEMA = "workbench.fleet/1"
LISTED = 15
"""Arms in the terminal's table."""


def shift_text(moved: Movement) -> str:
    """How far a constant moved."""
    unit = "mrad" if moved.name.endswith(("theta", "alpha", "beta")) else "10⁻³"
    unit = "mm" if moved.name.endswith((".a", ".d")) else unit
    return f"{1e3 * moved.shift:+.3g} {unit}".replace("-", "−")


def _of_worst(text: Callable[[Movement], str]) -> Callable[[ArmReport], str | None]:
    return lambda arm: None if arm.worst is None else text(arm.worst)


def _moved_most(arm: ArmReport) -> str:
    if arm.worst is not None:
        return arm.worst.name
    return "nothing" if len(arm.history.dates) > 1 else "one calibration"


MOVED = ResultFields(
    *("name", "joint", "law", "shift", "std", "sigmas", "since"),
    ResultField("rate_per_day", of="rate"),
    ResultField("tool", MM),
)
"""Of a `Movement`."""
ARM = ResultFields(
    ResultField("arm", of="history.arm", title="arm"),
    ResultField("dates", of="history.dates"),
    ResultField("worst_joint", of="joint"),
    ResultField("", title="moved most", of=_moved_most),
    ResultField("", title="by", of=_of_worst(shift_text)),
    ResultField("", title="σ", of=_of_worst(lambda worst: f"{worst.sigmas:.0f}")),
    ResultField("", title="since", of=_of_worst(lambda w: "drifts" if w.law is Law.DRIFT else f"{w.since}")),
    ResultField("tool", MM, title="tool", text="{:.2f}".format),
    ResultField("again_by", of="again", title="again by"),
    ResultField("moved", each=MOVED),
)
"""Of an `ArmReport`."""


@summary_of.register
def fleet_tables(fleet: Fleet) -> RenderableType:
    """The worst arms, those that could not be read, and what was decided."""
    shown = (fleet.worn or fleet.worst_first)[:LISTED]
    parts: list[RenderableType] = [ARM.table(plural(len(fleet.arms), "arm"), shown)]
    if (more := len(fleet.worn) - LISTED) > 0:
        parts.append(Text(f"and {more} more"))
    parts.append(Text(fleet.verdict, style="bold"))
    parts += [line("warning", f"{arm.arm}: {arm.why}") for arm in fleet.unread[:LISTED]]
    return Group(*parts, *(line("note", text) for text in notes_of(fleet)))


def notes_of(fleet: Fleet) -> tuple[str, ...]:
    """What was decided, one sentence each."""
    notes = [
        f"something moved beyond {fleet.minimum:.1f} σ, which chance exceeds in one of a hundred such fleets",
        f"again by: when a drift will have moved the tool by {1e3 * fleet.allowed:.3g} mm since the last "
        "calibration",
    ]
    if fleet.factor > 1.0:
        notes.append(
            f"calibrations scatter {fleet.factor:.2f} times as far as their errors imply; σ is widened"
        )
    return tuple(notes)


def fleet_json(fleet: Fleet) -> Json:
    """The result as plain data."""
    return document(
        SCHEMA,
        verdict=fleet.verdict,
        sigma_factor=fleet.factor,
        threshold_sigmas=fleet.minimum,
        allowed_mm=1e3 * fleet.allowed,
        arms=ARM.each(fleet.worst_first),
        unread=[{"arm": arm.arm, "reason": arm.why} for arm in fleet.unread],
        notes=notes_of(fleet),
    )

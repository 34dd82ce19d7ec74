"""Effects in the tables of a robot's file."""

from typing import Any

from workbench.arm.effects import EFFECTS, AbstractEffect
from workbench.base.toml import AbstractTableReader


def effect_of(table: dict, number: int, reader: AbstractTableReader) -> AbstractEffect:
    """An effect; settings other than joints and coefficients are keys of the same name."""
    what = f"[[effect]] {number + 1}"
    name = table.get("name")
    if not isinstance(name, str) or name not in EFFECTS:
        raise reader.fail(f"{what} has the name {name!r}; known: {', '.join(EFFECTS)}")
    kind, what = EFFECTS[name], f"{what} ({name})"
    reader.keys(table, {"name", "joints", "coefficients", "loads", *kind.settings()}, what)
    joints = table.get("joints", [])
    if not isinstance(joints, list) or not all(type(j) is int for j in joints):
        raise reader.fail(f"{what} joints must be a list of whole numbers from 1, not {joints!r}")
    if not isinstance(table.get("coefficients"), list) or not table["coefficients"]:
        raise reader.fail(f"{what} has no coefficients; give a list of numbers, their sizes in SI units")
    given = {key: table[key] for key in ("coefficients", *kind.settings()) if key in table}
    return reader.record(kind, {"joints": [j - 1 for j in joints], **given}, what)


def effect_table(effect: AbstractEffect) -> dict[str, Any]:
    """An effect as its table."""
    table: dict[str, Any] = {"name": str(effect.name)}
    if effect.joints:
        table["joints"] = [j + 1 for j in effect.joints]
    table["coefficients"] = list(effect.coefficients)
    for key in effect.settings():
        value = getattr(effect, key)
        if value != ():
            table[key] = list(value) if isinstance(value, tuple) else value
    return table

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
    settings = {
        key: _setting(getattr(kind, key), table[key], f"{what} {key}", reader)
        for key in kind.settings()
        if key in table
    }
    if "coefficients" not in table:
        raise reader.fail(f"{what} has no coefficients; give their sizes in SI units")
    coefficients = _setting((), table["coefficients"], f"{what} coefficients", reader)
    if not coefficients:
        raise reader.fail(f"{what} has no coefficients; give their sizes in SI units")
    return kind(tuple(j - 1 for j in joints), coefficients, **settings)


def _setting(default: Any, value: Any, what: str, reader: AbstractTableReader) -> Any:
    """A setting of an effect, of the same type as its default."""
    if isinstance(default, tuple):
        if not isinstance(value, list):
            raise reader.fail(f"{what} must be a list of numbers, not {value!r}")
        return tuple(reader.number(v, what) for v in value)
    if isinstance(default, float):
        return reader.number(value, what)
    if type(default) is int and isinstance(value, list):
        return tuple(_setting(default, v, what, reader) for v in value)
    if type(value) is not type(default):
        kinds = {int: "a whole number", bool: "true or false", str: "a word in quotes"}
        raise reader.fail(f"{what} must be {kinds[type(default)]}, not {value!r}")
    return value


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

"""What a file's columns were taken to be, as the `columns` option says it, and what else each may be."""

from workbench.base.units import EXAMPLES, Quantity, parse_heading
from workbench.data.observation import known_columns
from workbench.data.readers.column_meanings import TableColumn
from workbench.data.readers.columns_option import GROUPS, IGNORED, NamedUnit
from workbench.data.readers.headings import quantities_of
from workbench.data.readers.read import Preview


def understood_as(preview: Preview) -> dict[str, str]:
    """Each heading with its meaning."""
    return {c.heading: ours(c) for c in preview.columns if c.heading}


def ours(column: TableColumn) -> str:
    return IGNORED if column.key is None else NamedUnit(column.key, column.unit).heading()


def lacks_unit(column: TableColumn) -> bool:
    """Whether a column is a quantity whose unit nobody said."""
    quantities = () if column.key is None else quantities_of(column.key)
    return column.unit is None and any(q is not Quantity.NUMBER for q in quantities)


def with_column(columns: dict[str, str], heading: str, is_now: str) -> dict[str, str]:
    """The same with one column something else.

    What had been that is left out, and columns of its kind that lack a unit have the same one.

    Args:
        columns: Meanings by heading.
        heading: The file's.
        is_now: Ours with its unit, or "-".
    """
    columns = {**columns}
    name, unit = parse_heading(is_now)
    for other, was in columns.items() if name != IGNORED else ():
        key, known = parse_heading(was)
        if key == name:
            columns[other] = IGNORED
        elif unit and known is None and key != IGNORED and quantities_of(key) == quantities_of(name):
            columns[other] = f"{key}[{unit}]"
    return {**columns, heading: is_now}


def meanings(joints: int) -> tuple[str, ...]:
    """What a column may be, with every usual unit, as a mapping says it: "-" first, which leaves it out."""
    keys = [f"q{k + 1}" for k in range(joints)]
    keys += [key for group in ("xyz", "rpy", "rotvec", "quat", "matrix") for key in GROUPS[group]]
    keys += [name for c in known_columns().values() if c.kept for name in c.names(joints)]
    keys += ["sigma_x", "sigma_y", "sigma_z", *(f"distance{k}" for k in range(1, 7))]
    found = [IGNORED]
    for key in keys:
        known = [q for q in quantities_of(key) if q is not Quantity.NUMBER]
        found += [f"{key}[{unit}]" for q in known for unit in EXAMPLES[q].split(" or ")] or [key]
    return tuple(found)

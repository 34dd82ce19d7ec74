"""All columns that a file may have: the table in `base/columns.py`, and those that observations bring."""

from workbench.base.columns import COLUMNS, Column
from workbench.data.observation import AbstractObservation
from workbench.parts import parts


def known_columns() -> dict[str, Column]:
    brought = (
        column for kind in parts("observations", AbstractObservation, classes=True) for column in kind.brings
    )
    return {column.name: column for column in (*brought, *COLUMNS.values())}

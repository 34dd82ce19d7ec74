"""All columns that a file may have: the table in `base/columns.py`, and those that observations bring."""

from functools import lru_cache
from typing import Any

from workbench.base.columns import COLUMNS, Column
from workbench.data.observations import OBSERVATIONS


def known_columns() -> dict[str, Column]:
    return _by_name(tuple(OBSERVATIONS.values()), tuple(COLUMNS.values()))


@lru_cache(maxsize=4)
def _by_name(kinds: tuple[Any, ...], table: tuple[Column, ...]) -> dict[str, Column]:
    brought = (column for kind in kinds for column in kind.brings)
    return {column.name: column for column in (*brought, *table)}

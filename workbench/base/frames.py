"""Tables as data frames of pandas, or of polars where only that is installed; imported when one is needed."""

from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from workbench.base.errors import MissingExtraError

if TYPE_CHECKING:
    from pandas import DataFrame


def data_frame(columns: Mapping[str, Any], *, index: str | None = None) -> "DataFrame":
    """Columns by heading as a data frame.

    Args:
        index: The column that numbers or names the rows; polars has no index and keeps it as a column.
    """
    with suppress(ImportError):
        import pandas

        frame = pandas.DataFrame(dict(columns))
        return frame if index is None else frame.set_index(index)
    try:
        import polars
    except ImportError:
        raise MissingExtraError("a data frame", extra="pandas") from None
    return polars.DataFrame(dict(columns))  # type: ignore[return-value]

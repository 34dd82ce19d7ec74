"""Tables as pandas data frames; pandas is an extra, and imported when one is asked for."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from workbench.base.errors import MissingExtraError

if TYPE_CHECKING:
    from pandas import DataFrame


def data_frame(columns: Mapping[str, Any], *, index: str | None = None) -> "DataFrame":
    """Columns by heading as a data frame.

    Args:
        index: The column that numbers or names the rows.

    Raises:
        MissingExtraError: pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise MissingExtraError("a data frame", extra="pandas") from None
    frame = pandas.DataFrame(dict(columns))
    return frame if index is None else frame.set_index(index)

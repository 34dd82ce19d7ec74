"""Rows to fit and rows to judge by, from one file or from two."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from workbench.data.dataset import Dataset

Split = TypeVar("Split", bound="AbstractSplit")


@dataclass(frozen=True, eq=False, kw_only=True)
class AbstractSplit:
    """Rows to fit and rows to judge by.

    Args:
        train_rows: Rows to fit, indices into the data.
        held_out_rows: Rows that were held out, indices into the data; those from another file have none.
        held_out_data: The held-out rows.
        excluded: Excluded rows, with the reason.
    """

    train_rows: np.ndarray
    held_out_rows: np.ndarray
    held_out_data: Dataset
    excluded: tuple[tuple[int, str], ...]
    notes: tuple[str, ...]

    @property
    def is_one_file(self) -> bool:
        """Whether the held-out rows come from the same file as the others."""
        return len(self.held_out_rows) == len(self.held_out_data)

    def without_held_out(self: Split, lost: Mapping[int, str]) -> Split:
        """The same without some held-out rows; those of the same file are listed as excluded.

        Args:
            lost: Indices into `held_out_data`, with the reason.
        """
        if not lost:
            return self
        fewer = self.held_out_data.take(np.delete(np.arange(len(self.held_out_data)), [*lost]))
        if not self.is_one_file:
            return replace(self, held_out_data=fewer)
        named = ((int(self.held_out_data.row[i]), why) for i, why in lost.items())
        return replace(
            self,
            held_out_data=fewer,
            held_out_rows=np.delete(self.held_out_rows, [*lost]),
            excluded=(*self.excluded, *named),
        )

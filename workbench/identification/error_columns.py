"""Errors of the nominal and of every identified arm side by side: the columns of ARIA Figs. 7 and 11."""

from dataclasses import dataclass

import numpy as np

from workbench.data.prediction import RowComponents, row_components
from workbench.identification.record import Identification


@dataclass(frozen=True, eq=False)
class Column:
    """Errors of one arm.

    Args:
        title: NOM, OLS …
        train: On the rows that were fitted.
        held_out: On the rows that were not.
    """

    title: str
    train: RowComponents
    held_out: RowComponents


def columns_of(result: Identification) -> tuple[Column, ...]:
    """The nominal arm (base and tool fitted where they are free) and every algorithm's."""
    train, held_out = result.data.take(result.train_rows), result.held_out_data
    robots = [("NOM", result.aligned)]
    robots += [(run.fit.title, run.fit.calibrated) for run in result.runs.values()]
    return tuple(
        Column(title, row_components(robot, train), row_components(robot, held_out))
        for title, robot in robots
    )


def order_of_measuring(result: Identification) -> np.ndarray:
    """Place of every training and then every held-out row along l, counted from 1."""
    train, held_out = result.data.row[result.train_rows], result.held_out_data.row
    if len(result.held_out_rows) != len(held_out):  # from another file: behind the others
        held_out = held_out + train.max(initial=0) + 1
    place = np.empty(len(train) + len(held_out), np.int64)
    place[np.argsort(np.concatenate([train, held_out]), kind="stable")] = np.arange(1, len(place) + 1)
    return place

"""Poses kept while jogging, before and after calibration; how long what extras keep in the session stays."""

import csv
from dataclasses import dataclass

import numpy as np
import pytest

from workbench import Motion, tool_poses
from workbench.base import se3
from workbench.session import replay
from workbench.session.commands.arm import CapturePose, Jog
from workbench.session.commands.data import MeasureVirtualArm, with_data
from workbench.session.commands.identify import Identify
from workbench.session.export import captured_csv
from workbench.session.part import AbstractPart, GoesWith

ONE, TWO = (0.2, 0.6, -0.4, 0.1, 0.5, -0.3), (-0.4, 0.9, -0.9, 0.3, 0.2, 1.0)


def saved(session):
    """The file of the kept poses: its name, and its columns by their headings."""
    name, content = captured_csv(session)
    rows = [*csv.DictReader(content.decode().splitlines())]
    return name, {head: np.array([float(row[head]) for row in rows]) for head in rows[0]}


def places(columns, model):
    return 1e-3 * np.stack([columns[f"{model}_{axis}[mm]"] for axis in "xyz"], axis=1)


def test_kept_poses_show_what_a_calibration_changes(worker, do, first):
    session = do(Jog(ONE), CapturePose(), Jog(TWO), CapturePose())
    assert session.choices.captured == (ONE, TWO)
    name, columns = saved(session)
    assert name == "aria-poses.csv"
    assert [columns[f"q{i}[deg]"] for i in range(1, 7)] == pytest.approx(np.rad2deg([ONE, TWO]).T, abs=1e-9)
    assert not [head for head in columns if head.startswith("calibrated")]
    session = do(MeasureVirtualArm(3, more=30), Identify(("opt2",)))
    columns, actual = saved(session)[1], session.measurements.loaded.actual
    real = se3.inverse(actual.base.pose) @ tool_poses(actual, Motion(np.array([ONE, TWO])))
    off = np.linalg.norm(places(columns, "calibrated") - real[:, :3, 3], axis=1)
    change = np.linalg.norm(places(columns, "calibrated") - places(columns, "nominal"), axis=1)
    assert (off < 0.05 * change).all()
    assert replay(first, worker.journal).choices.captured == session.choices.captured


@dataclass(frozen=True)
class OfRows(AbstractPart):
    goes_with = GoesWith.MEASUREMENTS
    value: int = 0


@dataclass(frozen=True)
class OfPlate(AbstractPart):
    value: int = 0


def test_parts_are_kept_by_type_and_as_long_as_what_they_go_with(first):
    session = first.with_part(OfRows(1)).with_part(OfPlate(2))
    assert session.with_part(OfRows(3)).part(OfRows) == OfRows(3)
    kept = (session.part(OfRows), session.part(OfPlate), first.part(OfRows))
    assert kept == (OfRows(1), OfPlate(2), None)
    for without in (session.without_part(OfRows), with_data(session, None)):
        assert (without.part(OfRows), without.part(OfPlate)) == (None, OfPlate(2))

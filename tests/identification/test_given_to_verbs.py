"""Verbs take what a notebook has at hand, and refuse the rest in one sentence."""

import typing
from dataclasses import fields
from inspect import signature

import numpy as np
import pytest

import workbench as wb
from workbench.identification.fit_choices import ChoiceFields, FitChoices
from workbench.identification.problem import Noise

ARM = wb.load_robot("aria")
ROWS = wb.measure_poses(ARM, 30, seed=3)[1]


@pytest.fixture(scope="module")
def csv(tmp_path_factory):
    return wb.write_measurements(ROWS, tmp_path_factory.mktemp("rows") / "rows.csv")


def fit(*args, **options):
    return wb.identify(*args, algorithms="ols", **options)


def numbers(found):
    return found.best.fit.x


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ({"noise": (1e-4, 2e-4)}, {"noise": Noise(1e-4, 2e-4)}),
        ({"noise": "0.1mm,0.01deg"}, {"noise": Noise(1e-4, float(np.deg2rad(0.01)))}),
        ({"exclude": [3, 4]}, {"exclude": {3: "by hand", 4: "by hand"}}),
        ({"exclude": np.array([3])}, {"exclude": {3: "by hand"}}),
        ({"held_out": "20%"}, {"held_out": 0.2}),
        ({"held_out": "0.2"}, {"held_out": 0.2}),
        ({"free": "joint1.theta"}, {"free": ("joint1.theta",)}),
        ({"frames": "shared"}, {"frames": "shared"}),
    ],
)
def test_choices_as_people_write_them(given, meant):
    name = next(iter(given))
    assert getattr(FitChoices(**given), name) == getattr(FitChoices(**meant), name)
    short, long = fit(ARM, ROWS, **given), fit(ARM, ROWS, **meant)
    np.testing.assert_array_equal(numbers(short), numbers(long))
    assert short.excluded == long.excluded


def test_names_and_files_and_frames_stand_for_robots_and_data(csv):
    pandas = pytest.importorskip("pandas")
    exact = numbers(fit(ARM, wb.read_measurements(csv)))
    for robot, data in (("aria", csv), (ARM, str(csv)), (ARM, pandas.read_csv(csv))):
        np.testing.assert_array_equal(numbers(fit(robot, data)), exact)
    held = fit(ARM, ROWS, held_out=str(csv))
    assert len(held.held_out_data) == len(ROWS)


@pytest.mark.parametrize(
    ("robot", "data", "options", "name"),
    [
        (ROWS, ARM, {}, "robot"),
        (ARM, np.zeros((3, 6)), {}, "data"),
        (ARM, ROWS, {"noise": "small"}, "noise"),
        (ARM, ROWS, {"noise": (-1.0, 1.0)}, "noise"),
        (ARM, ROWS, {"exclude": "3"}, "exclude"),
        (ARM, ROWS, {"held_out": None}, "held_out"),
        (ARM, ROWS, {"loss": "cubes"}, "loss"),
        (ARM, ROWS, {"prior": 3}, "prior"),
        (ARM, ROWS, {"region": 3}, "region"),
    ],
)
def test_the_rest_is_refused_by_name(robot, data, options, name):
    with pytest.raises(wb.WorkbenchError, match=rf"^{name} must be"):
        fit(robot, data, **options)


def test_type_checkers_know_the_fields_that_there_are():
    assert set(typing.get_type_hints(ChoiceFields)) == {f.name for f in fields(FitChoices)}
    for verb in (wb.identify, wb.diagnose):
        shown = signature(verb).parameters
        assert {f.name for f in fields(FitChoices)} < set(shown)
        assert shown["choices"].annotation == FitChoices | None
        assert shown["exclude"].default == {}

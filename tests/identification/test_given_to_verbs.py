"""Verbs take what a notebook has at hand, and refuse the rest in one sentence."""

import numpy as np
import pytest
from refusals import refuses

import workbench as wb
from workbench.base.errors import OptionError
from workbench.identification.fit_choices import FitChoices
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
    ("call", "name"),
    [
        (lambda: wb.evaluate(ROWS, ARM), "robot"),
        (lambda: wb.evaluate(ARM, ROWS, fit_frames="yes"), "fit_frames"),
        (lambda: wb.score(ARM, 3), "plate"),
        pytest.param(lambda: wb.compensate(ARM, ROWS), "trajectory", marks=pytest.mark.extra("trajectories")),
        (lambda: wb.measure_poses(ARM, "many"), "number"),
        pytest.param(
            lambda: wb.choose_poses(ARM, 8, method="luck"), "method", marks=pytest.mark.extra("poses")
        ),
        (lambda: wb.diagnose(ARM, ROWS, seed="one"), "seed"),
        (lambda: wb.show(3, open_browser=False), "robot"),
        (lambda: ARM.with_effects("backlash"), "effects"),
    ],
)
def test_every_verb_refuses_by_name(call, name):
    with refuses(OptionError, option=name):
        call()

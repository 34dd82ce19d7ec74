"""Verbs take what a notebook has at hand, and refuse the rest in one sentence."""

import typing
from dataclasses import fields
from inspect import signature

import numpy as np
import pytest
from refusals import refuses

import workbench as wb
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.base.errors import OptionError
from workbench.identification.fit_choices import ChoiceFields, FitChoices
from workbench.identification.problem import Noise
from workbench.plate.optimiser.optimise import DesignRequest, RequestFields

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
    with refuses(OptionError, option=name):
        fit(robot, data, **options)


@pytest.mark.extra("trajectories")
def test_every_verb_has_the_same_door(csv):
    assert wb.evaluate("aria", csv).errors == wb.evaluate(ARM, wb.read_measurements(csv)).errors
    path = csv.with_name("path.csv")
    np.savetxt(
        path,
        [[0.3, -0.5, 0.8, 0.4, 0.6, 0.1 * k] for k in range(4)],
        delimiter=",",
        comments="",
        header=",".join(f"q{j}[rad]" for j in range(1, 7)),
    )
    moved = wb.compensate("aria", path, nominal="aria")
    np.testing.assert_array_equal(moved.q, wb.compensate(ARM, wb.read_trajectory(path), nominal=ARM).q)
    _, rows = wb.measure_poses("aria", 5, effects="joint-compliance:2", seed=1)
    assert len(rows) == 5
    assert len(wb.score("aria", "table2").plate) == 10


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


def test_effects_come_one_by_one_or_in_a_list():
    effects = (JointCompliance((1,), (1e-5,)), JointCompliance((2,), (2e-5,)))
    assert ARM.with_effects(effects).effects == ARM.with_effects(*effects).effects == effects
    assert ARM.with_effects(effects).with_effects(()).effects == ()


def test_type_checkers_know_the_fields_that_there_are():
    for typed, record in ((ChoiceFields, FitChoices), (RequestFields, DesignRequest)):
        assert set(typing.get_type_hints(typed)) == {f.name for f in fields(record)}
    for verb in (wb.identify, wb.diagnose):
        shown = signature(verb).parameters
        assert {f.name for f in fields(FitChoices)} < set(shown)
        assert shown["choices"].annotation == FitChoices | None
        assert shown["exclude"].default == {}


def test_names_of_the_root_that_the_package_calls_as_they_are_have_it_too(tmp_path):
    q = np.full(6, 0.1)
    np.testing.assert_array_equal(wb.tool_poses("aria", q), wb.tool_poses(ARM, q))
    np.testing.assert_array_equal(
        wb.identification_jacobian(ARM, q, "joint1.theta")[1],
        wb.identification_jacobian(ARM, q, ("joint1.theta",))[1],
    )
    assert wb.solve("aria", wb.tool_poses(ARM, q)).branches
    assert wb.tool_poses is wb.tool_poses
    assert list(signature(wb.identification_jacobian).parameters) == ["robot", "at", "names"]


@pytest.mark.parametrize(
    ("call", "kind", "name"),
    [
        (lambda: wb.load_robot(3), OptionError, "source"),
        (lambda: wb.tool_poses(ROWS, np.zeros(6)), OptionError, "robot"),
        (lambda: wb.tool_poses(ARM, "abc"), OptionError, "joint positions"),
        (lambda: wb.tool_poses(ARM, [0.0] * 5), wb.WorkbenchError, "5 joint positions"),
        (lambda: wb.solve(3, np.eye(4)), OptionError, "robot"),
        (lambda: wb.write_measurements(ROWS, 3), OptionError, "path"),
        (lambda: wb.write_toml(ARM, 3), OptionError, "path"),
        (lambda: wb.read_urdf(3), OptionError, "path"),
        (lambda: wb.measure_poses(ARM, -1), OptionError, "number"),
        (lambda: wb.Robot.from_dh("x"), wb.WorkbenchError, "joint 1"),
    ],
)
def test_they_refuse_the_rest_by_name(call, kind, name):
    with pytest.raises(kind, match=name):
        call()

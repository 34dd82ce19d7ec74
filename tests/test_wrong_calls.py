"""What a notebook has at hand is taken, and a wrong value is refused in one sentence, never used."""

import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache
from inspect import Parameter, signature

import numpy as np
import pytest
from refusals import refuses

import workbench as wb
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.robot_toml import robot_to_table
from workbench.base.errors import DataError, FileError, OptionError, RobotError, ShapeError
from workbench.base.progress import Cancelled, running
from workbench.data.simulation.instruments import Observes

NUMBERS = (3, -1, 0.5, np.nan, True, (), (1.0, 2.0), [[1.0], [2.0, 3.0]])
WRONG = (*NUMBERS, "foo", "0.5", "", {}, {"foo": 3.0}, object())
DEFAULTS = ("Requirement", "PoseLimits", "FitChoices", "Frame", "Mounting", "Blocks", "Constraints")
"""Records whose fields all have one."""
RECORDS = {name: {} for name in DEFAULTS} | {
    "Wanted": {"position": 1e-3},
    "Region": {"min": np.zeros(3), "max": np.ones(3)},
    "Instrument": {"name": "gauge", "observes": Observes.POINT, "sigma_position": 1e-4},
    "Target": {"xyz": np.zeros(3)},
    "Plate": {"name": "mine", "targets": (), "region": wb.Region(min=np.zeros(3), max=np.ones(3))},
    "Motion": {"q": np.zeros((3, 6))},
    "Prior": {"names": ("joint1.theta",), "values": np.zeros(1), "information": np.eye(1)},
}


def right(folder):
    """Arguments with which each verb is called rightly, by its name."""
    aria, plate = wb.load_robot("aria"), wb.load_plate("table2")
    _, rows = wb.measure_poses(aria, 40, seed=1)
    q, pointed = rows.q[:5], aria.with_frames(tool=wb.Frame(np.array([0.0, 0.0, 0.1])))
    wb.write_measurements(rows, folder / "rows.csv")
    wb.write_urdf(aria, folder / "arm.urdf")
    fitting = ("identify", "diagnose", "evaluate", "extract", "rezero", "tcp", "verify")
    found = dict.fromkeys(fitting, (aria, rows)) | {
        **dict.fromkeys(("tool_poses", "link_frames", "identification_jacobian"), (aria, q)),
        **dict.fromkeys(("measure_plate", "score", "optimise_plate"), (aria, plate)),
        "solve": (aria, aria.predict(q)[0]),
        "follow": (aria, aria.predict(q)[0], q[0]),
        "measure_poses": (aria, 5),
        "read_measurements": (folder / "rows.csv",),
        "write_measurements": (rows, folder / "again.csv"),
        "write_plate": (plate, folder / "plate.toml"),
        "write_toml": (aria, folder / "arm.toml"),
        "write_urdf": (aria, folder / "copy.urdf"),
        "load_robot": ("aria",),
        "load_plate": ("table2",),
        "read_urdf": (folder / "arm.urdf",),
        "read_trajectory": (folder / "rows.csv",),
        "choose_poses": (aria, 5),
        "compensate": (aria, folder / "rows.csv"),
        "map_motors": (aria, rows.take(np.arange(9))),
        "frame": (pointed, wb.Dataset(q[:3], contact=["origin", "x", "xy"])),
        "try_plate": (aria, plate.with_joints(wb.score(aria, plate).measured.q, ("auto",) * 10)),
        "table_readings": ([{"a": 0.1, "alpha": 0.0, "d": 0.0, "theta": 0.0}],),
    }
    if "find_convention" in dir(wb):
        ur5 = wb.load_robot("ur5")
        table = [
            {k: v for k, v in row.items() if k in ("theta", "d", "a", "alpha")}
            for row in robot_to_table(ur5)["joint"]
        ]
        found["find_convention"] = (
            wb.table_readings(table),
            wb.measure_poses(ur5, 4, actual=ur5, instrument="ideal")[1],
        )
    if "read_rig" in dir(wb):
        from tests.extras.damaged.damaged_files import CAMERA, PIXELS, TARGET

        camera, target, pixels = (folder / name for name in ("camera.toml", "target.toml", "pixels.csv"))
        for path, text in ((camera, CAMERA), (target, TARGET), (pixels, PIXELS)):
            path.write_text(text)
        found |= {"read_rig": (camera, target), "read_pixels": (pixels, wb.read_rig(camera, target))}
    return found


OPTIONS = {
    "try_plate": {"arms": 1, "poses": 20},
    "compensate": {"nominal": "aria"},
    "read_pixels": {"dof": 2},
}
"""Of verbs that take long otherwise, or need one."""


def calls(verb, args):
    """Right arguments with one of them wrong."""
    options = OPTIONS.get(verb.__name__, {})
    names = [p.name for p in signature(verb).parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
    for place, name in enumerate(names):
        for wrong in WRONG:
            if place < len(args):
                yield (*args[:place], wrong, *args[place + 1 :]), options
            else:
                yield args, options | {name: wrong}


def check(call, *args, **options):
    """Runs to its end, or is refused in words; what takes long is cancelled at once."""
    try:
        with warnings.catch_warnings(), running(cancel=lambda: True), suppress(wb.WorkbenchError, Cancelled):
            warnings.simplefilter("ignore")
            found = call(*args, **options)
            if isinstance(found, Iterator):
                list(found)
    except Exception as error:
        pytest.fail(f"{call.__name__}{args}, {options}: {error!r}")


def test_a_wrong_argument_is_refused_in_words(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # where "foo" may be written
    for name, given in right(tmp_path).items():
        if name in dir(wb):  # or else of an extra that is not installed
            verb = getattr(wb, name)
            with running(cancel=lambda: True), suppress(Cancelled):
                verb(*given, **OPTIONS.get(name, {}))
            for args, options in calls(verb, given):
                check(verb, *args, **options)


@pytest.mark.parametrize("name", RECORDS)
def test_a_wrong_field_of_a_record_is_refused_in_words(name):
    if name not in dir(wb):
        pytest.skip("of an extra that is not installed")
    kind, fields = getattr(wb, name), RECORDS[name]
    for field in signature(kind).parameters:
        for wrong in WRONG:
            check(lambda **given: repr(kind(**given)), **{**fields, field: wrong})


@cache
def arm():
    return wb.load_robot("aria")


@cache
def rows():
    return wb.measure_poses(arm(), N, seed=1)[1]


N = 40
BALL = np.full(3, np.nan)
NO_ROTATION = 2.0 * np.eye(3)[None].repeat(N, 0)
TWO_TARGETS = {"name": "mine", "targets": (), "region": wb.Region(min=[0, 0, 0], max=[1, 1, 1])}


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ({"noise": "0.1mm,0.01deg"}, {"noise": wb.Noise(1e-4, float(np.deg2rad(0.01)))}),
        ({"noise": (1e-4, 2e-4)}, {"noise": wb.Noise(1e-4, 2e-4)}),
        ({"exclude": np.array([3, 4])}, {"exclude": {3: "by hand", 4: "by hand"}}),
        ({"held_out": "20%"}, {"held_out": 0.2}),
        ({"free": "joint1.theta"}, {"free": ("joint1.theta",)}),
        ({"region": "table2"}, {"region": wb.load_plate("table2").region}),
    ],
)
def test_choices_are_taken_as_people_write_them(given, meant):
    (name,) = given
    assert repr(getattr(wb.FitChoices(**given), name)) == repr(getattr(wb.FitChoices(**meant), name))


def test_names_files_and_frames_stand_for_robots_and_data(tmp_path):
    csv = wb.write_measurements(rows(), tmp_path / "rows.csv")
    exact = wb.evaluate(arm(), wb.read_measurements(csv)).errors.position_mm
    import pandas as pd

    for robot, data in (("aria", csv), (arm(), str(csv)), (arm(), pd.read_csv(csv))):
        assert wb.evaluate(robot, data).errors.position_mm == exact
    assert len(wb.FitChoices(held_out=str(csv)).held_out) == N
    assert len(wb.score("aria", "table2", sigma="0.2mm,0.02deg").plate) == 10


def test_effects_come_one_by_one_or_in_a_list():
    effects = (JointCompliance((1,), (1e-5,)), JointCompliance((2,), (2e-5,)))
    assert arm().with_effects(effects).effects == arm().with_effects(*effects).effects == effects
    assert arm().with_effects(effects).with_effects(()).effects == ()


def data(**columns):
    return wb.Dataset(**{"q": rows().q, "position": rows().position} | columns)


def one_unknown():
    q = rows().q.copy()
    q[7, 2] = np.nan
    return q


REFUSED = {
    OptionError: [
        ("robot", lambda: wb.identify(rows(), arm())),
        ("data", lambda: wb.identify(arm(), np.zeros((3, 6)))),
        ("sigma", lambda: wb.score(arm(), "table2", sigma="0.02deg,0.2mm")),
        ("evaluation_poses", lambda: wb.score(arm(), "table2", evaluation_poses=np.full((5, 6), np.nan))),
        ("tip", lambda: wb.load_robot("aria", tip="flange")),
        ("effects", lambda: arm().with_effects("backlash")),
        ("base", lambda: arm().with_frames(base=np.eye(4))),
        (None, lambda: arm().with_values({"joint1.theta": np.nan})),
        ("rows", lambda: rows().take([100])),
        ("other", lambda: rows().joined(rows().to_frame())),
        ("noise", lambda: wb.FitChoices(noise=wb.Noise(-1e-4))),
        ("held_out", lambda: wb.FitChoices(held_out="120%")),
        ("xyz", lambda: wb.Target(xyz=BALL)),
        ("sigma", lambda: wb.Target(xyz=np.zeros(3), sigma=(-1e-4, 0.0))),
        ("size", lambda: wb.Plate(**TWO_TARGETS, size=(0.5, 0.0, 0.01))),
        ("exclude", lambda: data(exclude=[2] * N)),
        ("rotation", lambda: data(rotation=np.zeros((N, 3)))),
    ],
    ShapeError: [
        (None, lambda: wb.tool_poses(arm(), [0.0] * 5)),
        (None, lambda: rows().joined(wb.measure_poses("iiwa7", 5)[1])),
        (None, lambda: wb.identify(arm(), rows(), noise=wb.Noise(joints=(1e-4,) * 5))),
        (None, lambda: wb.score(arm(), seven_joints())),
    ],
    DataError: [
        (None, lambda: data(rotation=NO_ROTATION)),
        (None, lambda: data(q=one_unknown())),
        (None, lambda: wb.identify(arm(), rows(), held_out=rows())),
        (None, lambda: wb.identify(arm(), rows().to_frame().rename(columns={"q2[rad]": "q1[rad]"}))),
        (None, lambda: wb.solve(arm(), arm().predict(rows().q[0]), limits=[[1.0, -1.0]] * 6)),
        (None, lambda: wb.Frame(rotation=np.zeros((3, 3)))),
    ],
    FileError: [
        (None, lambda: wb.write_toml(arm(), "arm.urdf")),
        (None, lambda: wb.write_toml(arm(), "a\0b.toml")),
        (None, lambda: wb.load_plate("a" * 300 + ".toml")),
    ],
    RobotError: [(None, lambda: wb.Robot.from_dh(3))],
}


def seven_joints():
    plate = wb.load_plate("table2")
    return replace(plate, targets=(replace(plate.targets[0], q=np.zeros(7)),))


@pytest.mark.parametrize(
    ("kind", "option", "call"), [(kind, *case) for kind in REFUSED for case in REFUSED[kind]]
)
def test_what_is_wrong_is_refused_in_one_sentence(kind, option, call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with refuses(kind, **({"option": option} if option else {})) as refused:
        call()
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_rows_are_kept_out_by_zeros_and_ones_too():
    kept = data(exclude=[0] * 39 + [1])
    assert wb.evaluate(arm(), kept).data.row.tolist() == list(range(39))
    unknown = data(q=one_unknown(), exclude=np.arange(N) == 7)
    assert len(wb.evaluate(arm(), unknown).data.row) == 39


def test_labels_are_texts():
    named = data(session=np.array(["a", None] * 20, object), group=[1] * N)
    assert (named.sessions, named.group.dtype.kind) == (("a", ""), "U")


def test_held_out_rows_of_a_file_are_those_that_are_not_fitted():
    found = wb.identify(arm(), rows().take(np.arange(30)), held_out=rows(), algorithms=("ols",))
    assert len(found.held_out_data) == 10

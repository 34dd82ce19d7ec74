"""Verbs and records of the root with each argument replaced by a wrong value: never an error from inside."""

import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cache
from inspect import Parameter, signature
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest

import workbench as wb
from workbench.base.argument_checks import with_fields
from workbench.base.errors import OptionError, RobotError, ShapeError
from workbench.base.progress import Cancelled, running
from workbench.data.simulation.instruments import Observes

NUMBERS = (3, -1, 0.5, np.nan, True, (), (1.0, 2.0), [[1.0], [2.0, 3.0]])
WRONG = (*NUMBERS, "foo", "0.5", "", {}, {"foo": 3.0}, object())
RECORDS = {
    "Wanted": {"position": 1e-3},
    "Requirement": {},
    "Region": {"min": np.zeros(3), "max": np.ones(3)},
    "Instrument": {"name": "gauge", "observes": Observes.POINT, "sigma_position": 1e-4},
    "DesignRequest": {},
    "PoseLimits": {},
    "FitChoices": {},
    "Frame": {},
    "Mounting": {},
    "Target": {"xyz": np.zeros(3)},
    "Plate": {"name": "mine", "targets": (), "region": wb.Region(min=np.zeros(3), max=np.ones(3))},
    "Blocks": {},
    "Constraints": {},
    "Motion": {"q": np.zeros((3, 6))},
    "Prior": {"names": ("joint1.theta",), "values": np.zeros(1), "information": np.eye(1)},
}


@cache
def right():
    """Arguments with which each verb is called rightly, by its name."""
    folder = Path(mkdtemp())
    aria, plate = wb.load_robot("aria"), wb.load_plate("table2")
    _, rows = wb.measure_poses(aria, 40, seed=1)
    q = rows.q[:5]
    wb.write_measurements(rows, folder / "rows.csv")
    wb.write_urdf(aria, folder / "arm.urdf")
    return {
        "tool_poses": (aria, q),
        "link_frames": (aria, q),
        "identification_jacobian": (aria, q),
        "solve": (aria, aria.predict(q)[0]),
        "follow": (aria, aria.predict(q), q[0]),
        "measure_poses": (aria, 5),
        "measure_plate": (aria, plate),
        "read_measurements": (folder / "rows.csv",),
        "identify": (aria, rows),
        "diagnose": (aria, rows),
        "evaluate": (aria, rows),
        "score": (aria, plate),
        "optimise_plate": (aria, plate),
        "split_sessions": (rows, 20),
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
        "extract": (aria, rows),
        "map_motors": (aria, rows),
        "rezero": (aria, rows),
        "tcp": (aria, rows),
        "frame": (aria, rows),
        "try_plate": (aria, plate),
        "identification_jacobian_blocks": (aria, q, ("joint1.theta",)),
        "table_readings": ([{"a": 0.1, "alpha": 0.0, "d": 0.0, "theta": 0.0}],),
        "find_convention": ((), ()),
        "read_rig": (None, folder / "target.toml"),
        "read_pixels": (folder / "pixels.csv", None),
        "verify": (aria, rows),
    }


def calls(verb, args):
    """Right arguments with one of them wrong."""
    names = [p.name for p in signature(verb).parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
    for place, name in enumerate(names):
        for wrong in WRONG:
            if place < len(args):
                yield (*args[:place], wrong, *args[place + 1 :]), {}
            else:
                yield args, {name: wrong}


def ends(call, *args, **options):
    """Runs to its end, or is refused; what takes long is cancelled at once."""
    with warnings.catch_warnings(), running(cancel=lambda: True), suppress(wb.WorkbenchError, Cancelled):
        warnings.simplefilter("ignore")
        found = call(*args, **options)
        if isinstance(found, Iterator):
            list(found)


@pytest.mark.parametrize("name", right())
def test_a_wrong_argument_is_refused_in_words(name, tmp_path, monkeypatch):
    if name not in dir(wb):
        pytest.skip("of an extra that is not installed")
    monkeypatch.chdir(tmp_path)  # where "foo" may be written
    for args, options in calls(getattr(wb, name), right()[name]):
        try:
            ends(getattr(wb, name), *args, **options)
        except Exception as error:
            pytest.fail(f"{name}{args}, {options}: {error!r}")


def made(kind, fields):
    """A record, as a notebook shows it."""
    return repr(kind(**fields))


@pytest.mark.parametrize("name", RECORDS)
def test_a_wrong_field_of_a_record_is_refused_in_words(name):
    if name not in dir(wb):
        pytest.skip("of an extra that is not installed")
    kind, fields = getattr(wb, name), RECORDS[name]
    for field in signature(kind).parameters:
        for wrong in WRONG:
            try:
                ends(made, kind, {**fields, field: wrong})
            except Exception as error:
                pytest.fail(f"{name}({field}={wrong!r}): {error!r}")


def test_sizes_are_read_with_their_units(aria):
    plate = wb.load_plate("table2")
    found = wb.score(aria, plate, sigma="0.2mm,0.02deg")
    assert found.sigma == pytest.approx((2e-4, np.deg2rad(0.02)))
    for sigma in ("0.2", "0.2mm", "0.02deg,0.2mm", (1e-4,), 1e-4, (np.inf, 1.0), (1e-4, np.nan)):
        with pytest.raises(OptionError) as refused:
            wb.score(aria, plate, sigma=sigma)
        assert refused.value.option == "sigma"
    for errors in ((np.nan, 1e-3), (1e-3, np.inf), (-1e-3, 0.0)):
        with pytest.raises(OptionError):
            wb.measure_poses(aria, 5, errors=errors)
    for sigma in ("0.2", "0.02deg", "0.2mm,0.02deg,1", (1e-4, np.inf)):
        with pytest.raises(OptionError) as refused:
            wb.optimise_plate(aria, plate, sigma=sigma)
        assert refused.value.option == "sigma"


def test_fields_of_records_are_read_with_their_units():
    kept = wb.Constraints(clearance="5mm", errors="1mm,0.1deg", floor="-2cm")
    assert (kept.clearance, kept.floor) == (0.005, -0.02)
    assert kept.errors == pytest.approx((1e-3, np.deg2rad(0.1)))
    blocks = wb.Blocks(heights="40mm,0.1m", tilts=("30deg", 0.0), shapes=(("50mm", "0deg", 0.0),))
    assert blocks.heights == (0.04, 0.1)
    assert blocks.tilts == pytest.approx((np.pi / 6, 0.0))
    assert blocks.shapes == ((0.05, 0.0, 0.0),)
    assert wb.Wanted(position="0.3mm") == wb.Wanted(position=3e-4)


@pytest.mark.parametrize("size", ["0.5", "0.5 deg", -1e-3, np.nan, np.inf])
@pytest.mark.parametrize(
    "verb", [pytest.param(v, marks=pytest.mark.extra("pendant")) for v in ("tcp", "frame")]
)
def test_an_accuracy_without_its_unit_is_refused(verb, size):
    arm, rows = right()["identify"]
    with pytest.raises(OptionError) as refused:
        getattr(wb, verb)(arm, rows, wanted=size)
    assert refused.value.option == "wanted"


ONE_TARGET = {"xyz": np.zeros(3)}
ONE_PLATE = {
    "name": "mine",
    "targets": (wb.Target(np.zeros(3)),),
    "region": wb.Region(min=[0, 0, 0], max=[1, 1, 1]),
}


@pytest.mark.parametrize(
    ("kind", "fields", "option", "value"),
    [
        (wb.Plate, ONE_PLATE, "xyz", np.array([0.0, np.nan, 0.0])),
        (wb.Plate, ONE_PLATE, "rpy", np.array([0.0, np.inf, 0.0])),
        (wb.Plate, ONE_PLATE, "xyz", np.zeros(2)),
        (wb.Plate, ONE_PLATE, "size", np.array([0.5, 0.0, 0.01])),
        (wb.Plate, ONE_PLATE, "anchors", np.full((3, 3), np.nan)),
        (wb.Target, ONE_TARGET, "xyz", np.array([0.0, np.nan, 0.0])),
        (wb.Target, ONE_TARGET, "sigma", (-1e-4, 0.0)),
        (wb.Blocks, {}, "grid", np.nan),
        (wb.Blocks, {}, "heights", (0.1, np.inf)),
        (wb.Constraints, {}, "clearance", np.inf),
        (wb.Region, {"min": np.zeros(3)}, "max", np.full(3, np.inf)),
        (wb.Prior, {"names": ("joint1.theta",), "information": np.eye(1)}, "values", np.array([np.nan])),
    ],
)
def test_numbers_of_records_are_finite_and_in_range(kind, fields, option, value):
    with pytest.raises(OptionError) as refused:
        kind(**{**fields, option: value})
    assert refused.value.option == option


@pytest.mark.parametrize(
    "noise",
    [
        wb.Noise("a"),
        wb.Noise(-1e-4),
        wb.Noise(1e-4, rotation=0.0),
        wb.Noise(joints=3),
        wb.Noise(joints=(-1e-4,)),
    ],
)
def test_a_noise_of_no_size_is_refused(noise):
    with pytest.raises(OptionError) as refused:
        wb.FitChoices(noise=noise)
    assert refused.value.option == "noise"


def test_joint_readings_may_be_exact_and_orientations_unmeasured():
    assert wb.FitChoices(noise=wb.Noise(1e-4, np.nan, joints=(0.0,) * 6)).noise.joints == (0.0,) * 6


@pytest.mark.parametrize(
    ("verb", "record", "option", "set_value", "other"),
    [
        ("optimise_plate", {"request": wb.DesignRequest(number=6)}, "number", 6, 8),
        ("identify", {"choices": wb.FitChoices(noise="0.1mm")}, "noise", "0.1mm", "0.2mm"),
        ("diagnose", {"choices": wb.FitChoices(seed=1)}, "seed", 1, 2),
    ],
)
def test_a_field_given_twice_must_have_one_value(verb, record, option, set_value, other):
    call, args = getattr(wb, verb), right()[verb]
    with pytest.raises(OptionError) as refused:
        call(*args, **record, **{option: other})
    assert refused.value.option == option
    ends(call, *args, **record, **{option: set_value})


def test_a_field_beside_a_record_that_leaves_it_open_is_taken():
    request = with_fields(wb.DesignRequest, wb.DesignRequest(places=40), {"number": 8})
    assert (request.number, request.places) == (8, 40)
    assert with_fields(wb.FitChoices, None, {"seed": 3}).seed == 3


@pytest.mark.parametrize("verb", ["score", "measure_plate", "optimise_plate"])
def test_a_plate_with_joint_positions_of_another_arm_is_refused(aria, verb):
    plate = wb.load_plate("table2")
    plate = replace(plate, targets=(replace(plate.targets[0], q=np.zeros(7)),))
    with pytest.raises(ShapeError) as refused:
        getattr(wb, verb)(aria, plate)
    assert (refused.value.expected, refused.value.found) == (6, 7)


@pytest.mark.extra("pendant")
def test_cells_of_a_joint_table_are_numbers():
    for rows in ([{"a": "x"}], [{"a": None}]):
        with pytest.raises(OptionError):
            wb.table_readings(rows)
    for call in (lambda: wb.Robot.from_dh(3), lambda: wb.Robot.from_dh([{"a": 0.1}], limits=3)):
        with pytest.raises(RobotError):
            call()


@pytest.mark.parametrize(
    ("driver", "found", "expected"),
    [("direction", 2, 6), ("torque", 1, 6), ("wrench", 3, 6), ("payload", 2, 1)],
)
def test_drivers_of_a_motion_have_as_many_columns_as_they_need(driver, found, expected):
    with pytest.raises(ShapeError) as refused:
        wb.Motion(np.zeros((3, 6)), **{driver: np.zeros((3, found))})
    assert (refused.value.expected, refused.value.found) == (expected, found)


def test_joint_positions_are_rows(aria):
    with pytest.raises(ShapeError):
        wb.tool_poses(aria, wb.Motion(np.zeros(6)))


@pytest.mark.parametrize("share", [-0.1, 1.0, np.nan, "120%", "nan"])
def test_a_share_that_is_none_is_refused(share):
    with pytest.raises(OptionError) as refused:
        wb.FitChoices(held_out=share)
    assert refused.value.option == "held_out"

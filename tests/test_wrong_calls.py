"""Verbs and records of the root with each argument replaced by a wrong value: never an error from inside."""

import warnings
from contextlib import suppress
from functools import cache
from inspect import Parameter, signature
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest

import workbench as wb
from workbench.base.argument_checks import with_fields
from workbench.base.errors import OptionError
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
        "compare_fleet": (folder,),
        "compensate": (aria, folder / "rows.csv"),
        "extract": (aria, rows),
        "map_motors": (aria, rows),
        "rezero": (aria, rows),
        "tcp": (aria, rows),
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
        call(*args, **options)


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
    for sigma in ("0.2", "0.2mm", "0.02deg,0.2mm", (1e-4,), 1e-4):
        with pytest.raises(OptionError):
            wb.score(aria, plate, sigma=sigma)
    for errors in ((np.nan, 1e-3), (1e-3, np.inf), (-1e-3, 0.0)):
        with pytest.raises(OptionError):
            wb.measure_poses(aria, 5, errors=errors)


@pytest.mark.parametrize("noise", [wb.Noise("a"), wb.Noise(-1e-4), wb.Noise(1e-4, rotation=0.0)])
def test_a_noise_of_no_size_is_refused(noise):
    with pytest.raises(OptionError):
        wb.FitChoices(noise=noise)


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

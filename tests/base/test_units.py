import numpy as np
import pytest

from workbench.base import units
from workbench.base.errors import UnitError
from workbench.base.units import Quantity, conversion, parse_quantity, to_si

DEG = np.pi / 180
IN_SI = {
    Quantity.ANGLE: {"rad": 1, "mrad": 1e-3, "grad": np.pi / 200, "arcmin": DEG / 60}
    | dict.fromkeys(("deg", "°", "Grad"), DEG),
    Quantity.LENGTH: {"mm": 1e-3, "µm": 1e-6, "um": 1e-6, "in": 0.0254},
    Quantity.TIME: {"s": 1, "min": 60},
    Quantity.TORQUE: {"N*m": 1, "Nm": 1, "N·m": 1},
    Quantity.NUMBER: {"-": 1, "": 1},
    Quantity.MASS: {"kg": 1},
}


@pytest.mark.parametrize(
    ("unit", "quantity", "si"), [(unit, kind, si) for kind, own in IN_SI.items() for unit, si in own.items()]
)
def test_one_of_each_unit_in_si(unit, quantity, si):
    assert to_si(np.array([2.0]), unit, quantity)[0] == pytest.approx(2.0 * si, rel=1e-14)


def test_common_units_are_those_of_the_registry(monkeypatch):
    common = dict(units.COMMON)
    monkeypatch.setattr("workbench.base.units.COMMON", {})
    for text, known in common.items():
        assert conversion.__wrapped__(text, known.quantity) == known


@pytest.mark.parametrize(
    ("unit", "value", "celsius"),
    [("degC", 23.5, 23.5), ("C", 0.0, 0.0), ("K", 300.0, 26.85), ("degF", 212.0, 100.0), ("F", 32.0, 0.0)],
)
def test_temperatures_have_offsets(unit, value, celsius):
    assert to_si(np.array([value]), unit, Quantity.TEMPERATURE)[0] == pytest.approx(celsius, abs=1e-9)


OTHERS = dict.fromkeys(("foo", "9**9**9**9", "__import__('os')"), Quantity.LENGTH)
OTHERS |= {"mm": Quantity.ANGLE, "": Quantity.ANGLE, "deg": Quantity.NUMBER}


@pytest.mark.parametrize(("unit", "quantity"), OTHERS.items())
def test_other_units_are_refused(unit, quantity):
    with pytest.raises(UnitError) as caught:
        to_si(np.array([1.0]), unit, quantity)
    assert caught.value.unit == unit


def test_a_joint_may_be_an_angle_or_a_length():
    assert conversion("deg", Quantity.ANGLE, Quantity.LENGTH).quantity is Quantity.ANGLE
    assert conversion("mm", Quantity.ANGLE, Quantity.LENGTH).quantity is Quantity.LENGTH


def test_whole_millimetres_turn_into_the_nearest_metres():
    whole = np.arange(1.0, 2000.0)
    assert to_si(whole, "mm", Quantity.LENGTH).tolist() == [float(f"{value / 1000:.3f}") for value in whole]


def test_headings():
    parts = {"q1[deg]": ("q1", "deg"), "q1 (deg)": ("q1", "deg"), "x / mm": ("x", "mm")}
    parts |= {"x in mm": ("x", "mm"), "qw": ("qw", None), "qw[]": ("qw", ""), "Temp [°C]": ("Temp", "°C")}
    assert {text: units.parse_heading(text) for text in parts} == {
        text: units.Heading(*own) for text, own in parts.items()
    }


def test_what_is_a_unit():
    assert all(map(units.is_unit, ("mm", "deg", "°C", "Nm")))
    assert not any(map(units.is_unit, ("", "-", "Nr", "X", "Joint 1", "T")))


def test_settings():
    assert parse_quantity("0.05 mm", Quantity.LENGTH) == pytest.approx(5e-5)
    assert parse_quantity(" 1e-2° ", Quantity.ANGLE) == pytest.approx(np.radians(0.01))
    for bad in ("0.05", "mm", "1 deg", "x mm"):
        with pytest.raises(UnitError):
            parse_quantity(bad, Quantity.LENGTH)

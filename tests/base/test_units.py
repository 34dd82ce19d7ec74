import numpy as np
import pytest

from workbench.base.errors import UnitError
from workbench.base.units import (
    COMMON,
    Heading,
    Quantity,
    conversion,
    is_unit,
    parse_heading,
    parse_quantity,
    to_si,
)


@pytest.mark.parametrize(
    ("unit", "quantity", "si"),
    [
        ("rad", Quantity.ANGLE, 1.0),
        ("deg", Quantity.ANGLE, np.pi / 180),
        ("°", Quantity.ANGLE, np.pi / 180),
        ("Grad", Quantity.ANGLE, np.pi / 180),
        ("grad", Quantity.ANGLE, np.pi / 200),
        ("mrad", Quantity.ANGLE, 1e-3),
        ("arcmin", Quantity.ANGLE, np.pi / 180 / 60),
        ("mm", Quantity.LENGTH, 1e-3),
        ("µm", Quantity.LENGTH, 1e-6),
        ("um", Quantity.LENGTH, 1e-6),
        ("in", Quantity.LENGTH, 0.0254),
        ("s", Quantity.TIME, 1.0),
        ("min", Quantity.TIME, 60.0),
        ("kg", Quantity.MASS, 1.0),
        ("N*m", Quantity.TORQUE, 1.0),
        ("Nm", Quantity.TORQUE, 1.0),
        ("N·m", Quantity.TORQUE, 1.0),
        ("-", Quantity.NUMBER, 1.0),
        ("", Quantity.NUMBER, 1.0),
    ],
)
def test_one_of_each_unit_in_si(unit, quantity, si):
    assert to_si(np.array([2.0]), unit, quantity)[0] == pytest.approx(2.0 * si, rel=1e-14)


def test_common_units_are_those_of_the_registry(monkeypatch):
    common = dict(COMMON)
    monkeypatch.setattr("workbench.base.units.COMMON", {})
    for text, known in common.items():
        assert conversion.__wrapped__(text, known.quantity) == known


@pytest.mark.parametrize(
    ("unit", "value", "celsius"),
    [("degC", 23.5, 23.5), ("°C", 0.0, 0.0), ("K", 300.0, 26.85), ("degF", 212.0, 100.0)],
)
def test_temperatures_have_offsets(unit, value, celsius):
    assert to_si(np.array([value]), unit, Quantity.TEMPERATURE)[0] == pytest.approx(celsius, abs=1e-9)


@pytest.mark.parametrize(
    ("unit", "quantity"),
    [
        ("foo", Quantity.LENGTH),
        ("mm", Quantity.ANGLE),
        ("", Quantity.ANGLE),
        ("deg", Quantity.NUMBER),
        ("C", Quantity.TEMPERATURE),
        ("9**9**9**9", Quantity.LENGTH),
        ("__import__('os')", Quantity.LENGTH),
    ],
)
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


@pytest.mark.parametrize(
    ("text", "heading"),
    [
        ("q1[deg]", Heading("q1", "deg")),
        ("q1 (deg)", Heading("q1", "deg")),
        ("x / mm", Heading("x", "mm")),
        ("x in mm", Heading("x", "mm")),
        ("Temperatur [°C]", Heading("Temperatur", "°C")),
        ("qw", Heading("qw", None)),
        ("qw[]", Heading("qw", "")),
    ],
)
def test_headings(text, heading):
    assert parse_heading(text) == heading


def test_what_is_a_unit():
    assert all(map(is_unit, ("mm", "deg", "°C", "Nm")))
    assert not any(map(is_unit, ("", "-", "Nr", "X", "Joint 1", "T")))


def test_settings():
    assert parse_quantity("0.05 mm", Quantity.LENGTH) == pytest.approx(5e-5)
    assert parse_quantity(" 1e-2° ", Quantity.ANGLE) == pytest.approx(np.radians(0.01))
    for bad in ("0.05", "mm", "1 deg", "x mm"):
        with pytest.raises(UnitError):
            parse_quantity(bad, Quantity.LENGTH)

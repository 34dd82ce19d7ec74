import numpy as np
import pytest

from workbench.data.accuracy_requirement import Requirement, Wanted

NAN = float("nan")


def test_the_papers_angle():
    requirement = Requirement()
    assert requirement.displacement == pytest.approx(1.7320508e-3)
    # 2 asin((5 − 1.7320508) / (2 · 1.4142136 · 200)) = 2 asin(0.00577697) = 0.01155401 rad
    assert requirement.angle == pytest.approx(0.01155401, abs=1e-8)
    assert f"{np.rad2deg(requirement.angle):.2f}" == "0.66"
    assert requirement.wanted.text == "1 mm per axis and 0.66°"
    requirement = Requirement(radius=8e-3, insertion=0.35, per_axis=2e-3)  # just kept in the worst case
    chord = 2.0 * requirement.insertion * np.sin(0.5 * requirement.angle)
    assert requirement.displacement + np.sqrt(2.0) * chord == pytest.approx(requirement.radius)


def test_lengths_are_held_against_the_limit_of_one_axis():
    wanted = Requirement().wanted
    assert wanted.within_by_norms(1e-3, wanted.rotation)
    lengths, angles = np.array([9e-4, 1.1e-3, NAN, 9e-4, 9e-4]), np.array([0.0, 0.0, 0.0, 0.02, NAN])
    assert wanted.within_by_norms(lengths, angles).tolist() == [True, False, False, False, True]
    assert Wanted(position=1e-3).within_by_norms(1e-3, np.inf)

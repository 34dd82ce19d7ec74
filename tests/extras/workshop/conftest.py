"""A plate with every kind of target, tilted itself, to be made."""

import numpy as np
import pytest
from generator import turn

from workbench.base import se3
from workbench.extras.workshop.fixture import fixture_of
from workbench.plate.plate import Kind, Plate, Target
from workbench.plate.region import Region


def plate_of(*places, kinds=("seat",), size=(0.3, 0.2, 0.015), lean=(0.1, -0.05, 0.4)):
    """A leaning plate; each place is (x, y, height, tilt, azimuth, spin) on it [m, rad]."""
    pose = se3.pose(se3.rpy_to_matrix(np.array(lean)), np.array([0.4, 0.1, 0.2]))
    targets = []
    for i, (x, y, height, tilt, azimuth, spin) in enumerate(places):
        turned = turn("z", azimuth) @ turn("y", tilt) @ turn("z", spin) @ turn("x", np.pi)
        there = pose @ se3.pose(turned[:3, :3], np.array([x, y, height]))
        targets.append(
            Target(xyz=there[:3, 3], rpy=se3.matrix_to_rpy(there[:3, :3]), kind=Kind(kinds[i % len(kinds)]))
        )
    return Plate(
        name="Leaning",
        targets=tuple(targets),
        region=Region(min=np.array([0.2, -0.1, 0.2]), max=np.array([0.5, 0.3, 0.5]), cube=0.1),
        xyz=pose[:3, 3],
        rpy=np.array(lean),
        size=None if size is None else np.array(size),
    )


@pytest.fixture(scope="session")
def mixed():
    return plate_of(
        (-0.09, 0.05, 0.06, 0.3, 0.7, 0.2),
        (0.0, -0.03, 0.05, 0.5, -2.0, 1.1),
        (0.09, 0.04, 0.045, 0.0, 0.0, -0.6),
        kinds=("seat", "socket", "point"),
    )


@pytest.fixture(scope="session", params=["table2", "mixed"])
def made_plate(request, plate, mixed):
    return mixed if request.param == "mixed" else plate


@pytest.fixture(scope="session")
def fixture(made_plate):
    return fixture_of(made_plate)

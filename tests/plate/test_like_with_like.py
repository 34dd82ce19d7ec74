"""The same plate under the same assumptions, from wherever its figure is asked, and said there."""

from dataclasses import replace

import numpy as np
import pytest

from workbench import PlateDesign, optimise_plate, write_plate
from workbench.base.errors import DataError
from workbench.plate import design
from workbench.plate.optimiser import optimise
from workbench.plate.plate import Kind
from workbench.plate.tolerances import EXACT, PIN_PLAY, Production

OWN = Production(tolerance=(5e-5, 1e-3), play=(2e-5, 2e-3))


def of_kind(plate, kind):
    return replace(plate, targets=tuple(replace(t, kind=kind) for t in plate.targets))


@pytest.fixture
def searched(monkeypatch):
    """What each search was asked for: how the plate is made, and what is read."""
    seen = []

    def search(setting, number, **_):
        seen.append((setting.plate.production, setting.kind))
        return PlateDesign(plate=setting.plate, cost=1e-4, rotation=1e-4, start_cost=2e-4)

    monkeypatch.setattr(optimise, "optimise", search)
    monkeypatch.setattr(design, "plate_region_poses", lambda robot, plate: np.zeros((1, robot.dof)))
    return seen


def test_a_search_assumes_the_same_making_from_python_and_as_a_command(searched, run, aria, plate, tmp_path):
    """From Python the drawn pins had no play; the command overruled the play that a plate's file states."""
    plates = (
        (plate, (replace(EXACT, play=PIN_PLAY), "seat")),
        (replace(plate, production=OWN), (OWN, "seat")),
        (replace(of_kind(plate, Kind.SOCKET), production=OWN), (replace(OWN, play=(0.0, 0.0)), "socket")),
    )
    for given, requested in plates:
        optimise_plate(aria, given)
        path = write_plate(given, tmp_path / "given.toml")
        assert run("plate", "optimise", path, "--robot", "aria", "--out", "best.toml")[0] == 0
        assert searched == [requested, requested]
        searched.clear()
    options = ("plate", "optimise", "table2", "--robot", "aria", "--out", "best.toml")
    assert run(*options, "--play", "none", "--tolerance", "0.1mm,0deg")[0] == 0
    assert searched == [(Production(tolerance=(1e-4, 0.0)), "seat")]


def test_a_plate_is_moved_to_the_best_place_that_is_tried(searched, monkeypatch, aria, plate):
    """Only targets were moved, on a plate that stayed where no search could make it good."""
    sizes = []

    def search(setting, number, *, places, **_):
        plate = setting.plate
        sizes.append(places)
        if plate.xyz[2] < 0.15:
            raise DataError("nothing fits there")
        return PlateDesign(plate=plate, cost=np.hypot(*plate.xyz[:2]), rotation=0.0, start_cost=1.0)

    monkeypatch.setattr(optimise, "optimise", search)
    found = optimise_plate(aria, plate, moves=True).plate
    assert np.hypot(*plate.xyz[:2]) - np.hypot(*found.xyz[:2]) == pytest.approx(0.1 * aria.reach)
    assert np.allclose(found.heights, plate.heights)
    assert max(sizes[:-1]) < sizes[-1] == optimise.POOL_BLOCKS
    locked = (replace(plate.targets[0], locked=True), *plate.targets[1:])
    for kept, moves in ((plate, False), (replace(plate, targets=locked), True)):
        assert np.array_equal(optimise_plate(aria, kept, moves=moves).plate.xyz, kept.xyz)


def test_only_seats_have_play_and_orientations(plate):
    sockets = replace(of_kind(plate, Kind.SOCKET), production=OWN)
    assert sockets.assumptions == "targets made within ±0.05 mm, ±0.057°"
    known = replace(sockets, targets=tuple(replace(t, sigma=(5e-5, 1.0)) for t in sockets.targets))
    assert known.assumptions == "targets known to 0.05 mm (one σ)"
    assert replace(plate, production=OWN).assumptions.endswith("seat play ±0.02 mm, ±0.11°")

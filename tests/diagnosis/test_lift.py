"""What a file doesn't tell: how the base stands, a mass, how a lift gives way as it extends."""

import numpy as np
import pytest
from lift import LOST, draw, files, measure, rotation
from round_trip import read_arm, read_rows

from workbench import Motion, diagnose, write_toml
from workbench.arm.effects.tilting import ExtensionClearance, ExtensionCompliance


def campaign(folder, seed, *, tilts=True, lost=LOST, masses=True, **truth):
    """An arm's robot and rows through files, and what is true of it."""
    rng = np.random.default_rng(seed)
    actual = draw(rng, **truth)
    columns = measure(actual, rng, rows=80)
    if not tilts:
        columns = {name: values for name, values in columns.items() if not name.startswith("tilt")}
    return *files(folder, columns, lost, masses), actual


def down(actual):
    """Gravity in the base of a virtual arm, at the beginning."""
    return (actual.level @ rotation([0.0, 0.0, 0.7])).T @ [0.0, 0.0, -9.81]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lift")
    robot, data, actual = campaign(folder, 9001)
    return folder, actual, diagnose(robot, data)


def test_the_lift_is_named_and_nothing_false_is_certain(found):
    _, actual, result = found
    kinds = {c.kind for c in result.causes}
    assert "extension-compliance" in kinds
    false = "base-drift encoder-scale thermal-growth joint-coupling gravity-direction"
    assert not kinds & set(false.split())
    sizes = {type(e): (e.coefficients[0], a.std[0]) for a in result.effects for e in [a.effect]}
    for kind, true in ((ExtensionCompliance, actual.tipping[1]), (ExtensionClearance, actual.play[1])):
        value, std = sizes[kind]
        assert abs(value - true) < 4.0 * std < 0.5 * true


def test_how_the_base_stands_is_found_and_said(found):
    _, actual, result = found
    cosine = result.robot.gravity @ down(actual) / 9.81**2
    assert np.arccos(min(cosine, 1.0)) < 1e-4
    assert any("0.57" in note for note in result.notes)


def test_the_missing_mass_is_an_unknown_and_said(found):
    _, _, result = found
    assert result.robot.has_masses
    assert any(f"joint{LOST}" in note and "kg assumed" in note for note in result.notes)


def test_the_saved_file_alone_says_where_the_arm_is(found):
    """Gravity, masses and laws by plain numpy, as a stranger reads them."""
    folder, _, result = found
    write_toml(result.robot, folder / "found.toml")
    rows = read_rows(folder / "rows.csv")
    ours = read_arm(folder / "found.toml")(rows)[1][:, :3, 3]
    assert np.linalg.norm(ours - rows.position, axis=1).mean() < 2.0 * np.sqrt(3.0) * 5e-5
    theirs = result.robot.predict(Motion.of(result.data))[:, :3, 3]
    np.testing.assert_allclose(ours, theirs, atol=1e-9)


@pytest.mark.slow
def test_nothing_is_told_of_a_lift_whose_tipping_cannot_be_tried(tmp_path):
    """Without masses a lift that tips seems to slide too little: certain, and false for seven of eight."""
    robot, data, _ = campaign(tmp_path, 9001, tilts=False, masses=False)
    of_lift = [c for c in diagnose(robot, data).causes if 0 in c.joints]
    assert {c.confidence for c in of_lift} == {"cannot tell"}


@pytest.mark.slow
def test_a_level_measuring_frame_tells_gravity(tmp_path):
    """The base's orientation in it is fitted, and with it how the arm stands."""
    robot, data, actual = campaign(tmp_path, 9003, tilts=False)
    result = diagnose(robot, data, levelled=True)
    off = [g @ down(actual) / 9.81**2 for g in (result.robot.gravity, robot.gravity)]
    assert np.arccos(min(off[0], 1.0)) < 1e-3 < np.arccos(off[1])

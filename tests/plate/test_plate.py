"""Plates: the built-in one, the circle that makes it, files and their mistakes."""

import json
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench import Region, load_plate
from workbench.base.errors import FileError
from workbench.plate.patterns import circle
from workbench.plate.plate import Kind, Plate, Target
from workbench.plate.plate_toml import read_plate, write_plate

REGION = "region = { min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0], cube = 0.1 }\n"


def said(plate: Plate) -> str:
    """Everything that a plate says."""
    return json.dumps(asdict(plate), default=np.ndarray.tolist)


def test_the_circle_reproduces_table_2_to_its_printed_millimetres():
    plate = load_plate("table2")
    made = circle(10, centre=np.array([0.316, 0.354, 0.235]), radius=0.25)
    for target, printed in zip(made, plate.targets, strict=True):
        assert np.abs(target.xyz - printed.xyz).max() < 1e-3  # printed values are cut off, not rounded
        assert np.allclose(target.rpy, printed.rpy)


coordinates = st.floats(-10, 10).map(lambda v: round(v, 9))
triples = st.tuples(coordinates, coordinates, coordinates).map(lambda v: np.array(v, float))
facts = st.fixed_dictionaries(
    {
        "xyz": triples,
        "rpy": triples,
        "branch": st.sampled_from(["auto", "shoulder left, elbow up, wrist flip"]),
        "q": st.none() | st.lists(coordinates, min_size=5, max_size=7).map(lambda v: np.array(v, float)),
        "kind": st.sampled_from(list(Kind)),
        "sigma": st.none() | st.tuples(st.floats(0, 1e-3), st.floats(0, 1e-3)),
    }
)


@settings(max_examples=40)
@given(
    name=st.text(max_size=20).filter(lambda s: s.isprintable()),
    targets=st.lists(facts, max_size=4),
    xyz=triples,
    rpy=triples,
    sized=st.booleans(),
)
def test_round_trip(name, targets, xyz, rpy, sized, tmp_path_factory):
    # records are made here, not in strategies: checked ones use the random module, which these must not
    plate = Plate(
        name=name,
        targets=tuple(Target(**target) for target in targets),
        region=Region(min=np.array([0.0, -1.0, 0.25]), max=np.ones(3), cube=0.125),
        xyz=xyz,
        rpy=rpy,
        size=np.array([0.6, 0.5, 0.01]) if sized else None,
    )
    path = tmp_path_factory.mktemp("plate") / "plate.toml"
    assert said(read_plate(write_plate(plate, path))) == said(plate)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name = 'x'\n", "no region"),
        ("region = 3\n", "must be a table"),
        ("region = { min = [0, 0, 0] }\n", "no max"),
        ("region = { min = [0, 0, 0], max = [1, 0, 1] }\n", "empty along y"),
        ("region = { min = [0, 0, 0], max = [1, 1, 1], cube = -1 }\n", "0 m or more"),
        ("region = { min = [0, 0], max = [1, 1, 1] }\n", "region: min must be an array of shape"),
        (REGION + "colour = 'red'\n", "unknown key 'colour'"),
        (REGION + "size = [1, 1, 0]\n", "must be positive"),
        (REGION + "xyz = [1, 1, nan]\n", "finite"),
        (REGION + "[[target]]\nxyz = [0, 0, 1]\nrpy = [-150, 0, 0]\n", "looks like degrees"),
        (REGION + "[[target]]\nrpy = [0, 0, 0]\n", "target]] 1 has no xyz"),
        (REGION + "[[target]]\nxyz = [0, 0, 1e99]\n", "at most 60 m"),  # coal would crash
        (REGION + "[[target]]\nxyz = [0, 0, '1']\n", "finite number, not '1'"),
        (REGION + "[[target]]\nxyz = [0, 0, 1]\nkind = 'hole'\n", "'seat', 'socket' or 'point'"),
        (REGION + "[[target]]\nxyz = [0, 0, 1]\nsigma = [1e-4, -1]\n", "0 or more"),
        (REGION + "[[target]]\nxyz = [0, 0, 1]\nsigma = 3\n", "sigma"),
        (REGION + "[[target]]\nxyz = [0, 0, 1]\nbranch = 3\n", "branch"),
        (REGION + "[[target]]\nxyz = [0, 0, 1]\nq = []\n", "q must be a list of numbers"),
        (REGION + "[target]\nxyz = [0, 0, 1]\n", r"\[\[target\]\]"),
        ("region = {\n", "valid TOML"),
        (f"a = {'9' * 5000}", "valid TOML"),
        ("a = " + 1500 * "[", "brackets"),
    ],
)
def test_each_mistake_has_its_sentence(tmp_path, text, message):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(FileError, match=message) as error:
        load_plate(path)
    assert error.value.path == str(path)

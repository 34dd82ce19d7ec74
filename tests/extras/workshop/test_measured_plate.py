"""A plate of nothing but the table of a measuring machine."""

import numpy as np

from workbench.extras.workshop.csv_lists import targets_csv
from workbench.plate.measured_plate import load_plate
from workbench.plate.plate import Kind


def test_any_plate_option_takes_the_list_alone(tmp_path, made_plate):
    found = load_plate(written(tmp_path / "cmm.csv", targets_csv(made_plate)))
    assert np.allclose(found.poses, made_plate.poses, atol=1e-13)
    assert found.region.contains(found.poses[:, :3, 3]).all()
    assert "bounding box" in found.notes[0]
    points = "target,x[mm],y[mm],z[mm]\n2,0,0,100\n1,50,0,100\n"
    sockets = load_plate(written(tmp_path / "points.csv", points))
    assert [t.kind for t in sockets.targets] == [Kind.SOCKET] * 2
    assert np.allclose(sockets.targets[0].xyz, [0.05, 0.0, 0.1])


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path

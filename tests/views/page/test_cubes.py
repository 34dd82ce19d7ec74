"""Which faces of the cubes are drawn."""

import numpy as np
import pytest

from workbench.plate.region import Region
from workbench.views.page.scene.cubes import NORMALS, TURNS, outer_faces

REGION = Region(min=np.zeros(3), max=np.array([0.6, 0.5, 0.4]), cube=0.1)


def test_of_all_cubes_the_region_s_sides_are_drawn():
    faces = outer_faces(REGION, np.ones(REGION.cubes, bool))
    assert len(faces) == 2 * (6 * 5 + 5 * 4 + 4 * 6)
    beyond = REGION.centres[faces[:, 0]] + 0.1 * NORMALS[faces[:, 1]]
    assert ((beyond < REGION.min) | (beyond > REGION.max)).any(axis=1).all()


def test_a_hidden_cube_uncovers_one_face_of_each_neighbour():
    shown = np.ones(REGION.shape, bool)
    shown[2, 2, 1] = False
    faces = {tuple(face) for face in outer_faces(REGION, shown.ravel()).tolist()}
    whole = {tuple(face) for face in outer_faces(REGION, np.ones(REGION.cubes, bool)).tolist()}
    assert faces > whole
    hole = REGION.min + 0.1 * (np.array([2, 2, 1]) + 0.5)
    new = np.array(sorted(faces - whole))
    assert len(new) == 6
    assert REGION.centres[new[:, 0]] + 0.1 * NORMALS[new[:, 1]] == pytest.approx(np.tile(hole, (6, 1)))


def test_a_cube_alone_has_six_faces():
    assert len(outer_faces(REGION, np.arange(REGION.cubes) == 7)) == 6


def test_faces_look_outward():
    assert np.linalg.det(TURNS) == pytest.approx(np.ones(6))
    assert pytest.approx(NORMALS) == TURNS @ [0.0, 0.0, 1.0]

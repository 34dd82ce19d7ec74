"""Which faces of the cubes are drawn."""

import numpy as np
import pytest

from workbench.plate.region import Region
from workbench.views.appearance.shapes import box
from workbench.views.drawables.drawable import Mesh, Points
from workbench.views.page.scene.cube_mesh import FACE_ROTATIONS, NORMALS, outer_faces
from workbench.views.page.scene.picking import picked

REGION = Region(min=np.zeros(3), max=np.array([0.6, 0.5, 0.4]), cube=0.1)


def test_of_all_cubes_the_region_s_sides_are_drawn_and_look_outward():
    assert np.linalg.det(FACE_ROTATIONS) == pytest.approx(np.ones(6))
    assert pytest.approx(NORMALS) == FACE_ROTATIONS @ [0.0, 0.0, 1.0]
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


@pytest.mark.parametrize(("height", "first"), [(0.001, "measured"), (-0.001, "measured"), (-0.1, "target")])
def test_a_click_means_a_row_before_its_target_while_rows_are_looked_at(height, first):
    """With a plate that is the user's drawn beside the rows that were measured at its targets."""
    block = box(np.array([0.05, 0.05, 0.1]))
    place = np.array([[0.0, 0.0, block.vertices[:, 2].max() + height]])
    point = Points(places=place, colours=np.zeros((1, 3), np.uint8), numbers=np.array([7]), radius=0.01)
    drawn = (("target", Mesh(solid=block, colour=(0, 0, 0), number=2)), ("measured", point))
    ray = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
    assert picked(drawn, ray) == ("target", 2)
    assert picked(drawn, ray, points_first=True)[0] == first

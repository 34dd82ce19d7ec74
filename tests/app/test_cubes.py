"""Which cubes are drawn."""

import numpy as np

from workbench.app.scene.cubes import outermost
from workbench.design.region import Region

REGION = Region(min=np.zeros(3), max=np.array([0.6, 0.5, 0.4]), cube=0.1)


def test_of_all_cubes_those_at_the_region_s_sides_are_drawn():
    drawn = outermost(REGION, np.ones(REGION.cubes, bool))
    place = np.stack(np.unravel_index(drawn, REGION.shape), -1)
    assert ((place == 0) | (place == np.array(REGION.shape) - 1)).any(axis=1).all()
    assert len(drawn) == 6 * 5 * 4 - 4 * 3 * 2


def test_a_hidden_cube_uncovers_its_neighbours():
    shown = np.ones(REGION.shape, bool)
    shown[2, 2, 1] = False
    drawn = np.zeros(REGION.shape, bool)
    drawn.flat[outermost(REGION, shown.ravel())] = True
    assert drawn[[3, 2, 2], [2, 3, 2], [1, 1, 2]].all()
    assert not drawn[2, 2, 1]
    assert not drawn[4, 2, 1]
    assert (drawn <= shown).all()


def test_a_single_layer_is_drawn_whole():
    shown = np.zeros(REGION.shape, bool)
    shown[:, :, 2] = True
    assert len(outermost(REGION, shown.ravel())) == 30

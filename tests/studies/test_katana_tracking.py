"""Chapter 5 on a few virtual arms: reductions, what they hold for, and the numbers by hand."""

import numpy as np
import pytest

from studies import katana_printed as printed
from studies.conftest import KATANA
from studies.katana import FOLLOWING
from studies.katana_generator import NOMINAL, ORDERS, VirtualKatana
from studies.katana_tracking import (
    BEFORE,
    CIRCLE,
    GEOMETRY,
    LINE_FAR,
    LINE_NEAR,
    OURS,
    PATHS,
    STEPS,
    TILTING,
    drawing_katana,
    missed,
)


@pytest.fixture
def study(katana):
    return katana.tracking


@pytest.mark.slow
def test_the_paths_are_those_of_the_thesis(study):
    """The circle passes its four points; lines are straight; all begin and end at rest."""
    for point in printed.POINTS:
        assert np.linalg.norm(study.paths[0].poses[:, :3, 3] - point, axis=1).min() < 3e-3
    for path in study.paths[1:]:
        p = path.poses[:, :3, 3]
        away = np.cross(p - p[0], p[-1] - p[0])
        assert np.abs(away).max() < 1e-8
    assert all(np.abs(path.motion.velocity[[0, -1]]).max() < 1e-9 for path in study.paths)


@pytest.mark.slow
def test_tilting_first_reduces_more_than_the_thesis(study):
    mean = study.mean
    assert mean.shape == (KATANA["arms"] // FOLLOWING, len(STEPS), len(PATHS))
    for path in (CIRCLE, LINE_NEAR):
        assert np.median(mean[:, BEFORE, path] / mean[:, TILTING, path]) > 0.653 / 0.132
    assert (mean[:, TILTING, CIRCLE] < mean[:, GEOMETRY, CIRCLE]).all()
    assert (study.worse[:, TILTING, CIRCLE] < 0.05).all()


@pytest.mark.slow
def test_one_trajectory_does_not_teach_another_posture_but_the_workspace_does(study):
    far = study.mean[:, :, LINE_FAR]
    assert (far[:, OURS] < far[:, TILTING]).all()
    assert far[:, OURS].max() < 0.5 * far[:, TILTING].max()
    assert np.median(far[:, BEFORE] / far[:, OURS]) > 2.0


@pytest.mark.slow
def test_what_is_missed_is_a_distance(study):
    """A stiff and tight arm that misses its path by what its last link is too long, and by nothing else."""
    longer = NOMINAL.copy()
    longer[5, 4] += 5e-3
    path = study.paths[CIRCLE]
    for table, wanted in ((NOMINAL, 0.0), (longer, 5.0)):
        arm = VirtualKatana(
            table=table,
            clearance=np.zeros(5),
            backlash=np.zeros(5),
            stiffness=np.full(5, np.inf),
            waves=np.zeros((5, len(ORDERS), 2)),
        )
        np.testing.assert_allclose(missed(arm, drawing_katana(), path.q, path.poses), wanted, atol=1e-6)

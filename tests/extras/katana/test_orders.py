"""Tilt first and then geometry, or both at once: on the generator's arms and over virtual ones."""

import numpy as np
from katanas import SIGMA, TILTING, make_katana, still
from laws import poses
from orders import compare_orders, order_study
from test_katanas import stated

from workbench.arm.built_in_arms import load_robot
from workbench.data.dataset import Dataset
from workbench.identification.problem import Noise


def test_both_orders_leave_the_noise_where_geometry_alone_leaves_half_a_millimetre():
    """Judged on exact poses elsewhere; what is known of the joints is right to a twentieth."""
    seed = 30_001
    case = make_katana(seed, spread=0.0)
    rng = np.random.default_rng(seed)
    q = make_katana(seed + 100).state.q
    exact = poses(case.actual, case.hidden, still(q))
    held = Dataset(q=q, row=np.arange(len(q)), position=exact[:, :3, 3])
    known = [e.sized({n: c * rng.uniform(0.95, 1.05) for n, c in zip(e.names, e.coefficients, strict=True)})
             for e in stated(case.hidden)]  # fmt: skip
    found = compare_orders(case.robot, case.data, held, known=known, joints=TILTING, noise=Noise(*SIGMA))
    assert found.geometry > 0.25
    assert found.tilt_first < 0.1 * found.geometry
    assert found.together < 0.05 * found.geometry
    assert found.together < found.tilt_first


def test_over_virtual_arms_both_orders_reach_the_noise():
    """0.016 mm is the mean length of an error of 0.01 mm an axis."""
    found = np.array(order_study(load_robot("katana450"), arms=1, seed=1))
    assert (found[:, 0] > 0.3).all()
    np.testing.assert_allclose(found[:, 1:], 0.016, atol=0.004)

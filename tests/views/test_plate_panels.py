"""The plate tab's headline."""

import numpy as np

from workbench.views.page.panels.index import headline


def test_error_and_index_of_the_plate_stand_side_by_side_with_their_curves(first):
    shown = headline(first, [(1e-3, 0.6), (2e-3, 0.5), (np.inf, 0.4)])
    assert f">{1e3 * first.score.position:.3f} mm<" in shown
    assert f">O {first.score.per_target.mean():.4f}<" in shown
    assert shown.count("<polyline") == shown.count("<svg") == headline(first, []).count("<svg") == 2

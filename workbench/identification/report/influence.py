"""Picture of how far each constant's deviation moves the tool (Katana fig. 3.8)."""

import numpy as np
from matplotlib.figure import Figure

from workbench.arm.kinematics.influence import Influence, influence
from workbench.arm.motion import Motion
from workbench.identification.record import Identification
from workbench.report.figures import COLOURS, INK, grid, look, new_figure

MM = 1e3


def influence_figure(found: Influence, *, printed: dict[str, float] | None = None) -> Figure:
    """Least, mean and greatest influence of every constant over the poses.

    Args:
        printed: Means that a source prints [m], by constant; drawn as rings.
    """
    places = np.arange(len(found.names))
    with look():
        figure = new_figure(max(6.0, 0.42 * len(places) + 1.5), 3.0)
        axes = figure.subplots()
        series = (("least", found.least), ("mean", found.mean), ("greatest", found.greatest))
        for i, (name, values) in enumerate(series):
            axes.bar(places + 0.27 * (i - 1), MM * values, width=0.26, color=COLOURS[i], label=name)
        rings = {found.names.index(name): value for name, value in (printed or {}).items()}
        if rings:
            heights = [MM * value for value in rings.values()]
            axes.plot(list(rings), heights, "o", ms=7, mfc="none", mec=INK, mew=1.2, label="printed mean")
        axes.set_xticks(places, found.names, rotation=55, ha="right", rotation_mode="anchor")
        axes.set_ylabel("motion of the tool [mm]")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4)
        grid(axes)
    return figure


def influence_of_fit(result: Identification) -> Figure | None:
    """Influence of the arm's identified constants at the fitted poses; None where none was identified."""
    fit = result.best.fit
    own = {element.name for element in fit.calibrated.elements}
    names = tuple(name for name in fit.problem.names if name in own)
    if not names:
        return None
    return influence_figure(influence(fit.calibrated.with_effects(), Motion(fit.problem.data.q), names=names))

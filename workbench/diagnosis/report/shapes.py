"""Picture of joint errors: their shape over the joint's position with its standard error.

The constant part of a shape is the joint's zero, which the geometry holds: it is taken out over the rows.

    y(q) = (b(q) − b̄)ᵀ c,      std² = (b − b̄)ᵀ C (b − b̄)

with b the laws of all effects of one joint's own position and C their part of the covariance.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.axes import turns
from workbench.arm.motion import Motion
from workbench.diagnosis.record import Diagnosis
from workbench.report.drawing import (
    COLOURS,
    INK,
    grid,
    look,
    new_figure,
)

GRID = 800
COLUMNS = 2
SURE = 2.0
"""Standard errors of the band."""


def mapped(result: Diagnosis) -> dict[int, list[AbstractEffect]]:
    """Accepted errors of joints over their own position, by joint."""
    found: dict[int, list[AbstractEffect]] = {}
    for accepted in result.effects:
        if accepted.effect.maps_joint:
            for joint in accepted.effect.joints:
                found.setdefault(joint, []).append(accepted.effect)
    return dict(sorted(found.items()))


def shapes(result: Diagnosis) -> Figure | None:
    """One panel for every joint with an error of its own; None if no joint has one."""
    joints = mapped(result)
    if not joints:
        return None
    columns = min(COLUMNS, len(joints))
    lines = -(-len(joints) // columns)
    with look():
        figure = new_figure(10.0, 2.8 * lines + 0.3)
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes, (joint, effects) in zip(panels, joints.items(), strict=False):
            _shape(axes, result, joint, effects)
        for axes in panels[len(joints) :]:
            axes.set_visible(False)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _shape(axes: Axes, result: Diagnosis, joint: int, effects: list[AbstractEffect]) -> None:
    fit = result.after_fit
    chain = result.calibrated.chain
    q = fit.problem.data.q[:, joint]
    grid_q = np.linspace(q.min(), q.max(), GRID)
    basis = np.hstack([_basis(e, chain, grid_q, joint) for e in effects])
    basis -= np.hstack([_basis(e, chain, q, joint) for e in effects]).mean(0)
    names = [n for e in effects for n in e.names]
    places = [fit.problem.names.index(n) for n in names]
    shape = 1e3 * basis @ fit.x[places]
    variance = np.einsum("gi,ij,gj->g", basis, fit.covariance[np.ix_(places, places)], basis)
    std = 1e3 * np.sqrt(np.maximum(variance, 0.0))
    scale, unit = (float(np.rad2deg(1.0)), "°") if turns(chain, joint) else (1e3, "mm")
    x = scale * grid_q
    axes.fill_between(
        x, shape - SURE * std, shape + SURE * std, color=COLOURS[4], alpha=0.45, lw=0,
        label=f"± {SURE:g} standard errors",
    )  # fmt: skip
    axes.plot(x, shape, color=COLOURS[1], lw=1.8, label="error of the joint")
    axes.axhline(0.0, color=INK, lw=0.6)
    low = float(min((shape - SURE * std).min(), 0.0))
    height = max(float((shape + SURE * std).max()) - low, 1e-12)
    axes.plot(
        scale * q, np.full(len(q), low - 0.08 * height), "|", color=INK, ms=5, mew=0.5, label="measured there"
    )
    axes.set_title(f"joint {joint + 1}")
    axes.set_xlabel(f"{'angle' if unit == '°' else 'position'} of joint {joint + 1} [{unit}]")
    axes.set_ylabel(f"error [{'mrad' if unit == '°' else 'mm'}]")
    grid(axes, "both")


def _basis(effect: AbstractEffect, chain, q: np.ndarray, joint: int) -> np.ndarray:
    """Error of one joint per unit of every coefficient."""
    motion = Motion(np.repeat(q[:, None], chain.dof, axis=1))
    place = effect.joints.index(joint)
    return effect.law(chain, motion, np.zeros((0, 0, 6)))[:, place]

"""What camera, target and pictures contradict: intrinsics, or a print's size, that are not what was given."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.base.types import Freedom
from workbench.data.camera.camera import INTRINSICS
from workbench.data.dataset import Dataset
from workbench.identification.problem import Noise, Problem

BETTER, LEAST_PIXEL = 0.75, 0.05
"""Intrinsics are doubted where free ones leave this part of the corners' error, and so many px less."""
OUTSIDE = 3.0
"""Standard deviations of prior knowledge beyond which it is doubted."""


def doubts(
    problem: Problem, x: Float[np.ndarray, " p"], fitted: Callable[[Dataset], tuple[Problem, np.ndarray]]
) -> Iterator[str]:
    """Sentences on what the pictures contradict, with what to do.

    Args:
        problem: Of what the pictures may identify, joints' zeros at most, all corners weighed alike.
        x: Its answer.
        fitted: Such a problem of other data, and its answer.
    """
    data = problem.data
    rig = data.rig
    assert rig is not None, "pictures were fitted"
    values = dict(zip(problem.names, x.tolist(), strict=True))
    fixed = [camera for camera in rig.cameras if camera.free is Freedom.FIXED]
    if fixed:
        freed, other = fitted(replace(data, rig=rig.with_intrinsics(Freedom.AUTO)))
        was, now = pixel_error(problem, x), pixel_error(freed, other)
        if now < BETTER * was and was - now > LEAST_PIXEL:
            found = dict(zip(freed.names, other.tolist(), strict=True))
            name = fixed[0].name
            said = ", ".join(
                f"{k} {found[f'camera[{name}].{k}']:.4g}" for k in ("fx", "fy", "cx", "cy", "k1")
            )
            yield (
                f"the given intrinsics do not suit the pictures: corners {was:.2f} px off with them, "
                f'{now:.2f} px with free ones (camera {name}: {said}); set free = "auto" or calibrate it'
            )
    for camera in rig.cameras:
        for k, part in enumerate(INTRINSICS if camera.free is Freedom.AUTO else ()):
            off = values[f"camera[{camera.name}].{part}"] - float(camera.intrinsics[k])
            if abs(off) > OUTSIDE * camera.sigma[k]:
                yield (
                    f"camera {camera.name}: {part} is {off:+.4g} from the given one, more than {OUTSIDE:g} "
                    f"times its sigma {camera.sigma[k]:.3g}; check that they are of this camera and lens"
                )
    scale, known = values.get("target.scale", 0.0), rig.target.scale_sigma
    word = "larger" if scale > 0.0 else "smaller"
    if known and abs(scale) > OUTSIDE * known:
        yield (
            f"the target is {100 * abs(scale):.2f} % {word} than its file says, where {100 * known:.2g} % is "
            "expected; measure it and correct its sizes"
        )


def pixel_error(problem: Problem, x: Float[np.ndarray, " p"]) -> float:
    """Error of corners [px, root mean square of a coordinate]."""
    problem = problem.with_noise(Noise(0.0, 0.0, (), problem.noise.pixel))
    off = problem.physical(problem.residual(x)[: problem.size])
    return float(np.sqrt((off**2).sum() / problem.count))

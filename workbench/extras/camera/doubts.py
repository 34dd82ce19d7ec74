"""Contradictions between pictures, camera and target: wrong intrinsics or a wrong print size."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from workbench.base.types import Freedom
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import INTRINSICS, Camera
from workbench.extras.camera.rig import Rig, rig_of, with_rig
from workbench.extras.camera.target import PictureTarget
from workbench.identification.consider_covariance import Considered
from workbench.identification.problem import Noise, Problem

OUTSIDE = 3.0
"""Standard deviations of prior knowledge beyond which it is doubted."""
OTHER_LENS, OTHER_SIZE = 30.0, 8.0
"""Twice the gain in log likelihood from which on other intrinsics, or another size, are the right ones …"""
EITHER = 0.5
"""… and part of that by other intrinsics from which on the pictures can't tell which of both is wrong."""
ANY_SIZE = 0.03
"""Standard deviation of a target's relative size where nothing is known of it."""
MIN_SIGMA = 1e-4
"""A size that counts as exact is judged as if known to this, as pictures tell it no better."""


@dataclass(frozen=True, eq=False)
class PictureFit:
    """A fit with some given properties freed, at its answer `x`.

    Args:
        unlikelihood: Twice the negative log likelihood, all unknowns and what pictures share averaged out.
    """

    problem: Problem
    x: Float[np.ndarray, " p"]
    unlikelihood: float = 0.0

    @cached_property
    def values(self) -> dict[str, float]:
        """Answer by name."""
        return self.problem.named(self.x)

    @cached_property
    def pixel(self) -> float:
        """Error of corners [px, root mean square distance]."""
        problem = self.problem.with_noise(Noise(0.0, 0.0, (), self.problem.noise.own))
        off = problem.physical(problem.residual(self.x)[: problem.size])
        return float(np.sqrt(2.0 * (off**2).sum() / problem.count))

    def less_likely_than(self, other: "PictureFit") -> float:
        """Twice the log likelihood that another fit gains."""
        return self.unlikelihood - other.unlikelihood

    def scale(self, target: PictureTarget) -> float:
        """A board's size less the stated one, relative to it."""
        return self.values.get(f"{target.owner}.scale", 0.0)

    def strangeness(self, target: PictureTarget) -> float:
        """How many standard deviations of its knowledge a board's size is from the stated one."""
        return abs(self.scale(target)) / max(target.scale_sigma, MIN_SIGMA)

    def intrinsics(self, camera: Camera) -> Float[np.ndarray, "9"]:
        """Those of a camera."""
        names = (f"{camera.owner}.{part}" for part in INTRINSICS)
        given = zip(names, camera.intrinsics.tolist(), strict=True)
        return np.array([self.values.get(name, value) for name, value in given])


@dataclass(frozen=True, eq=False)
class Doubts:
    """What the pictures contradict.

    Args:
        sentences: Sentences with what to do.
        given: The pictures, with intrinsics that are contradicted let go.
        data: The same, with sizes that are contradicted let go as well.
        off: How far these seem to be from what was given, by name.
    """

    sentences: tuple[str, ...]
    given: Dataset
    data: Dataset
    off: Mapping[str, float]

    def considered(self, problem: Problem, deviations: Float[np.ndarray, " p"] | float = 0.0) -> Considered:
        """What it bends, beside constants that are uncertain.

        Args:
            problem: Of `data`.
            deviations: Of each of its unknowns that is uncertain as well; 0 of the others.
        """
        off = np.array([abs(self.off.get(name, 0.0)) for name in problem.names])
        return Considered(problem, off + deviations)


def find_doubts(fitted: Callable[[Dataset], PictureFit], data: Dataset) -> Doubts:
    """The given properties of camera and target that the pictures contradict, whatever the arm is.

    The pictures are fitted as given, with free intrinsics in place of fixed ones, and with a target of any
    size. What is given is doubted where another is far likelier, all else that is unknown averaged out: what
    the arm lacks moves intrinsics and sizes too. Sizes are doubted with intrinsics that were let go.

    Args:
        fitted: Fit of all that the pictures may identify of the arm, weighed by what it leaves.
        data: The pictures.
    """
    rig, notes = rig_of(data), []
    given, size = fitted(data), fitted(_of_any_size(data))
    is_other = False
    if rig.is_lens_fixed:
        let_go = with_rig(data, rig.with_intrinsics(Freedom.AUTO))
        lens = fitted(let_go)
        by_lens, by_size = given.less_likely_than(lens), given.less_likely_than(size)
        is_other = by_lens > OTHER_LENS and by_size > max(OTHER_SIZE, EITHER * by_lens)
        if is_other:
            notes.append(
                "the target's size or the focal length is wrong, and the pictures can't determine which: "
                f"{_larger(size)}, or {_lens_text(lens)}; check the printed square's side, or leave the "
                'intrinsics to be refined with free = "auto"'
            )
        elif by_lens > max(OTHER_LENS, by_size):
            notes.append(
                f"the given intrinsics do not fit the pictures: corners are {given.pixel:.2f} px off with "
                f"them, {lens.pixel:.2f} px with {_lens_text(lens)}; they were left free, so set "
                'free = "auto" or calibrate the camera'
            )
            data, given, size = let_go, lens, fitted(_of_any_size(let_go))
    if not is_other:
        is_strange = any(size.strangeness(target) > OUTSIDE for target in rig.targets)
        is_other = is_strange and given.less_likely_than(size) > OTHER_SIZE
        notes += _implausible(size if is_other else given, rig)
        if is_other:
            notes.append(f"{_larger(size, 'is ')}; measure it and correct its sizes")
    off = {f"{t.owner}.scale": size.scale(t) for t in rig.targets} if is_other else {}
    return Doubts(tuple(notes), data, size.problem.data if is_other else data, off)


def _of_any_size(data: Dataset) -> Dataset:
    """The pictures with targets of whose sizes nothing is known."""
    rig = rig_of(data)
    return with_rig(data, replace(rig, targets=tuple(replace(t, scale_sigma=ANY_SIZE) for t in rig.targets)))


def _implausible(fit: PictureFit, rig: Rig) -> list[str]:
    """What of each camera with a prior is farther from the given intrinsics than that allows."""
    found = []
    for camera in rig.cameras:
        off = fit.intrinsics(camera) - camera.intrinsics
        far = [
            f"{INTRINSICS[k]} {off[k]:+.4g} (sigma {camera.sigma[k]:.3g})"
            for k in range(4)
            if camera.free is Freedom.AUTO and abs(off[k]) > OUTSIDE * camera.sigma[k]
        ]
        if far:
            found.append(
                f"camera {camera.name}: {', '.join(far)}, more than {OUTSIDE:g} times sigma from the given "
                "intrinsics; check that they belong to this camera and lens"
            )
    return found


def _lens_text(fit: PictureFit) -> str:
    """Free intrinsics of the first camera."""
    camera = rig_of(fit.problem.data).cameras[0]
    values = zip(INTRINSICS[:5], fit.intrinsics(camera), strict=False)
    return f"free intrinsics (camera {camera.name}: {', '.join(f'{k} {v:.4g}' for k, v in values)})"


def _larger(fit: PictureFit, verb: str = "") -> str:
    """How much larger or smaller a board is than stated, and its squares; all boards that seem to be."""
    targets = rig_of(fit.problem.data).targets
    off = [t for t in targets if fit.strangeness(t) > OUTSIDE] or [max(targets, key=fit.strangeness)]
    return " and ".join(_size(t, fit.scale(t), verb) for t in off)


def _size(target: PictureTarget, scale: float, verb: str) -> str:
    board, more = target.charuco, "larger" if scale > 0.0 else "smaller"
    who = f"board '{target.name}'" if target.name else "the target"
    text = f"{who} {verb}{100 * abs(scale):.2f} % {more} than stated"
    if board is None:
        return text
    side = 1e3 * board.square
    return f"{text} (squares of {side * (1.0 + scale):.4g} mm, not {side:.4g} mm)"

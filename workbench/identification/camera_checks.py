"""Contradictions between pictures, camera and target: wrong intrinsics or a wrong print size."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.types import Freedom
from workbench.data.camera.camera import INTRINSICS
from workbench.data.camera.rig import Rig
from workbench.data.camera.target import Target
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.pixel_noise import Considered, Pictures
from workbench.identification.problem import Noise, Problem

BETTER, LEAST_PIXEL = 0.75, 0.05
"""What was given is doubted where other values leave this part of the corners' error, and so many px less."""
OUTSIDE = 3.0
"""Standard deviations of prior knowledge beyond which it is doubted."""
ANY_SIZE = 1.0
"""Standard deviation of a target's relative size where nothing is known of it."""
LEAST_SIGMA = 1e-4
"""A size that counts as exact is judged as if known to this, as pictures tell it no better."""
OUT_OF_LINE, FAR_OFF = 6.0, 2e-3
"""Pictures this many times the median off, and so many m, don't suit their joints."""


@dataclass(frozen=True, eq=False)
class PictureFit:
    """A fit with some given properties freed and all corners weighted alike; `x` is the solution."""

    problem: Problem
    x: Float[np.ndarray, " p"]

    @cached_property
    def values(self) -> dict[str, float]:
        """Answer by name."""
        return self.problem.named(self.x)

    @cached_property
    def pixel(self) -> float:
        """Error of corners [px, root mean square of a coordinate]."""
        problem = self.problem.with_noise(Noise(0.0, 0.0, (), self.problem.noise.pixel))
        off = problem.physical(problem.residual(self.x)[: problem.size])
        return float(np.sqrt((off**2).sum() / problem.count))

    def scale(self, target: Target) -> float:
        """A board's size less the stated one, relative to it."""
        return self.values.get(f"{target.owner}.scale", 0.0)

    def strangeness(self, target: Target) -> float:
        """How many standard deviations of its knowledge a board's size is from the stated one."""
        return abs(self.scale(target)) / max(target.scale_sigma, LEAST_SIGMA)

    def is_implausible_size(self, rig: Rig) -> bool:
        """Whether a board's size is farther from the stated one than the rig's knowledge of it."""
        return any(self.strangeness(t) > OUTSIDE for t in rig.targets)

    def implausible_intrinsics(self, rig: Rig) -> list[str]:
        """What of each camera is farther from the given intrinsics than their `sigma` allows, in words."""
        found = []
        for camera in rig.cameras:
            off = {
                part: self.values[f"camera[{camera.name}].{part}"] - float(camera.intrinsics[k])
                for k, part in enumerate(INTRINSICS if camera.free is Freedom.AUTO else ())
            }
            far = [
                f"{part} {off[part]:+.4g} (sigma {sigma:.3g})"
                for part, sigma in zip(off, camera.sigma.tolist(), strict=False)
                if abs(off[part]) > OUTSIDE * sigma
            ]
            found += [f"camera {camera.name}: {', '.join(far)}"] if far else []
        return found


@dataclass(frozen=True, eq=False)
class Doubts:
    """What the pictures contradict.

    Args:
        words: Sentences with what to do.
        data: The pictures, with what is contradicted let go.
        off: How far from what was given it seems to be, by name; none where nothing fixed is contradicted.
    """

    words: tuple[str, ...]
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

    @classmethod
    def of(cls, words: Iterable[str], given: PictureFit, better: PictureFit, *more: str) -> "Doubts":
        """From the fit as given and the one that suits; `more` are doubted though both have them."""
        off = dict(zip(better.problem.names, better.x - better.problem.start, strict=True))
        fixed = set(off) - set(given.problem.names) | set(more)
        return cls(tuple(words), better.problem.data, {name: off[name] for name in fixed})

    @classmethod
    def of_lens(cls, given: PictureFit, lens: PictureFit) -> "Doubts":
        """Against fixed intrinsics, from fits with them and with free ones."""
        rig = given.problem.data.rig
        assert rig is not None, "pictures were fitted"
        return cls.of([_against_lens(given, lens, rig)], given, lens)


def find_doubts(fitted: Callable[[Dataset], PictureFit], data: Dataset) -> Doubts:
    """The given properties of camera and target that the pictures contradict.

    The pictures are fitted as given, with free intrinsics in place of fixed ones, and with a target of any
    size: what then suits them, and as given does not, is to blame; both, where the pictures can't tell.

    Args:
        fitted: Fit of what the pictures may identify of the arm, joints' zeros at most.
        data: The pictures.
    """
    rig = data.rig
    assert rig is not None, "pictures were fitted"
    any_size = replace(rig, targets=tuple(replace(t, scale_sigma=ANY_SIZE) for t in rig.targets))
    given, size = (fitted(replace(data, rig=each)) for each in (rig, any_size))
    lens = fitted(replace(data, rig=rig.with_intrinsics(Freedom.AUTO))) if rig.is_lens_fixed else given
    words = tuple(_sentences(rig, given, lens, size))
    least = min(given.pixel, lens.pixel, size.pixel)
    if _suits(given, least):
        return Doubts(words, data, {})
    if _suits(lens, least):
        return Doubts.of(words, given, lens)
    return Doubts.of(words, given, size, *(f"{t.owner}.scale" for t in rig.targets))


def _suits(fit: PictureFit, least: float) -> bool:
    return BETTER * fit.pixel <= least or fit.pixel - least <= LEAST_PIXEL


def _sentences(rig: Rig, given: PictureFit, lens: PictureFit, size: PictureFit) -> Iterator[str]:
    """The doubts in words, from the fits as given, with free intrinsics and with a target of any size."""
    suits = partial(_suits, least=min(given.pixel, lens.pixel, size.pixel))
    is_suited, is_size = suits(given), given.is_implausible_size(rig)
    is_lens = bool(given.implausible_intrinsics(rig))
    if not is_suited:
        is_lens, is_size = suits(lens), suits(size)
        is_either = is_lens and is_size
    elif is_lens:
        is_either = not is_size and suits(size) and not size.implausible_intrinsics(rig)
    else:
        is_either = is_size and rig.is_lens_fixed and suits(lens) and not lens.is_implausible_size(rig)
    by_size = f"{size.pixel:.2f} px with {_larger(size, rig)}"
    if is_either:
        yield (
            "the target's size or the focal length is wrong, and the pictures can't determine which: "
            f"corners {given.pixel:.2f} px off as given, {by_size}, {_by_lens(lens, rig)}; check the printed "
            'square\'s side, or leave the intrinsics to be refined with free = "auto"'
        )
        return
    if is_lens and not is_suited:
        yield _against_lens(given, lens, rig)
        is_size = lens.is_implausible_size(rig)
    else:
        yield from (
            f"{words}, more than {OUTSIDE:g} times sigma from the given intrinsics; check that they are of "
            "this camera and lens"
            for words in (given if is_suited else size).implausible_intrinsics(rig)
        )
    if is_size:
        yield (
            f"{_larger(size, rig, 'is ')}: corners {given.pixel:.2f} px off with "
            f"the size given, {size.pixel:.2f} px with that one; measure it and correct its sizes"
        )


def _against_lens(given: PictureFit, lens: PictureFit, rig: Rig) -> str:
    return (
        f"the given intrinsics do not suit the pictures: corners {given.pixel:.2f} px off with them, "
        f'{_by_lens(lens, rig)}; set free = "auto" or calibrate the camera'
    )


def _by_lens(lens: PictureFit, rig: Rig) -> str:
    """What free intrinsics leave, and what they are of a fixed camera."""
    name = next((c.name for c in rig.cameras if c.free is Freedom.FIXED), rig.cameras[0].name)
    found = {k: lens.values.get(f"camera[{name}].{k}") for k in ("fx", "fy", "cx", "cy", "k1")}
    intrinsics = ", ".join(f"{k} {v:.4g}" for k, v in found.items() if v is not None)
    return f"{lens.pixel:.2f} px with free intrinsics (camera {name}: {intrinsics})"


def _larger(fit: PictureFit, rig: Rig, verb: str = "") -> str:
    """How much larger or smaller a board is than stated, and its squares; all boards that seem to be."""
    off = [t for t in rig.targets if fit.strangeness(t) > OUTSIDE] or [max(rig.targets, key=fit.strangeness)]
    return " and ".join(_size(t, fit.scale(t), verb) for t in off)


def _size(target: Target, scale: float, verb: str) -> str:
    board, more = target.charuco, "larger" if scale > 0.0 else "smaller"
    who = f"board '{target.name}'" if target.name else "the target"
    words = f"{who} {verb}{100 * abs(scale):.2f} % {more} than its file says"
    if board is None:
        return words
    side = 1e3 * board.square
    return f"{words} (squares of {side * (1.0 + scale):.4g} mm, not {side:.4g} mm)"


def mismatched_pictures(
    robot: Robot, data: Dataset, build: Callable[..., Problem] = Problem.build
) -> dict[int, float]:
    """Rows whose picture does not suit their joints, and how far the tool seems to be off [m]."""
    problem = build(robot, data, free=tuple(n for n in robot.joint_offsets if n in robot.default_free))
    problem = problem.with_noise(Noise(1e-3, 2e-3, (), problem.noise.pixel))
    x = Opt2(limit=40).search(problem).x
    off, _ = Pictures.at(problem, x).errors(Noise(1.0, 1.0, (), 0.5))
    lost = off > max(OUT_OF_LINE * float(np.median(off)), FAR_OFF)
    return {int(i): float(off[i]) for i in np.flatnonzero(lost)} if lost.mean() < 0.2 else {}

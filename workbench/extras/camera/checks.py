"""Contradictions between pictures, camera and target: wrong intrinsics or a wrong print size."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import INTRINSICS, Camera, project
from workbench.extras.camera.pixel_noise import Pictures, unlikeliness
from workbench.extras.camera.readings import PictureReadings, rig_of, with_rig
from workbench.extras.camera.rig import Rig
from workbench.extras.camera.target import PictureTarget
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.considered import Considered
from workbench.identification.noise import factor_at
from workbench.identification.problem import Noise, Problem

BETTER, MIN_PIXEL = 0.75, 0.07
"""What was given is doubted where other values leave this part of the corners' error, and so many px less."""
OUTSIDE = 3.0
"""Standard deviations of prior knowledge beyond which it is doubted."""
UNNOTICED = 0.3
"""Pixels by which a lens that is off may move the corners that were seen."""
CERTAIN = 4.0
"""Standard errors beyond which a board is of another size than stated."""
CONTRADICTED = 4.0
"""χ² of the change of intrinsics, for each of them, from which on those that were given are wrong."""
BLAMED = 0.5
"""Part of what the tool is off that wrong intrinsics may leave; an effect of the arm leaves more."""
SHOWN, VISIBLY = 12.0, 0.95
"""Twice the gain in log likelihood, and part of the corners' error left, without which no size is doubted."""
ANY_SIZE = 1.0
"""Standard deviation of a target's relative size where nothing is known of it."""
MIN_SIGMA = 1e-4
"""A size that counts as exact is judged as if known to this, as pictures tell it no better."""
OUT_OF_LINE, FAR_OFF = 6.0, 2e-3
"""Pictures this many times the median off, and so many m, don't suit their joints …"""
MAX_WRONG = 0.25
"""… if they are a smaller part of all."""
ROBUST_ROUNDS = 5
"""Fits in turn with pictures weighed by how far they were off."""
EXCHANGED = 7.0
"""Error of corners [px] from which on camera and target are tried in each other's place."""
ROUGH = Noise(1e-3, 2e-3, (), 1.0)
"""Corners share what an arm that is not calibrated yet lacks."""


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
        """Error of corners [px, root mean square distance]."""
        problem = self.problem.with_noise(Noise(0.0, 0.0, (), self.problem.noise.own))
        off = problem.physical(problem.residual(self.x)[: problem.size])
        return float(np.sqrt(2.0 * (off**2).sum() / problem.count))

    @cached_property
    def unlikeliness(self) -> float:
        """Twice the negative log likelihood, with all that corners of a picture share as their variance."""
        return unlikeliness(Pictures.at(self.problem, self.x))

    @cached_property
    def lack(self) -> float:
        """How far the tool is off in a picture beside the corners' own noise, where cameras see it [m]."""
        noise = self.problem.noise
        return float(np.hypot(noise.position, Pictures.at(self.problem, self.x).lever * noise.rotation))

    def scale(self, target: PictureTarget) -> float:
        """A board's size less the stated one, relative to it."""
        return self.values.get(f"{target.owner}.scale", 0.0)

    def strangeness(self, target: PictureTarget) -> float:
        """How many standard deviations of its knowledge a board's size is from the stated one."""
        return abs(self.scale(target)) / max(target.scale_sigma, MIN_SIGMA)

    def is_implausible_size(self, rig: Rig) -> bool:
        """Whether a board's size is farther from the stated one than the rig's knowledge of it."""
        return any(self.strangeness(t) > OUTSIDE for t in rig.targets)

    def implausible_intrinsics(self, rig: Rig) -> list[str]:
        """What of each camera is farther from the given intrinsics than their `sigma` allows, in words."""
        found = []
        pixels = PictureReadings.of(self.problem.data).pixels
        for c, camera in enumerate(rig.cameras):
            seen = pixels[:, c][np.isfinite(pixels[:, c, :, 0])]
            off = {
                part: self.values[f"camera[{camera.name}].{part}"] - float(camera.intrinsics[k])
                for k, part in enumerate(INTRINSICS if camera.free is Freedom.AUTO else ())
            }
            far = [
                f"{part} {off[part]:+.4g} (sigma {sigma:.3g})"
                for part, sigma in zip(off, camera.sigma.tolist(), strict=False)
                if abs(off[part]) > OUTSIDE * sigma and _moved(camera, seen, part, off[part]) > UNNOTICED
            ]
            found += [f"camera {camera.name}: {', '.join(far)}"] if far else []
        return found


def _moved(camera: Camera, seen: Float[np.ndarray, "n 2"], part: str, change: float) -> float:
    """How far a change of one of a camera's constants moves the corners it saw [px, root mean square]."""
    rays = np.append(camera.normalised(seen), np.ones((len(seen), 1)), axis=1)
    other = camera.intrinsics + change * (np.array(INTRINSICS) == part)
    off = project(rays, other).pixel - project(rays, camera.intrinsics).pixel
    return float(np.sqrt((off**2).sum(1).mean()))


@dataclass(frozen=True, eq=False)
class Doubts:
    """What the pictures contradict.

    Args:
        sentences: Sentences with what to do.
        data: The pictures, with what is contradicted let go.
        off: How far from what was given it seems to be, by name; none where nothing fixed is contradicted.
    """

    sentences: tuple[str, ...]
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

    @property
    def is_of_lens(self) -> bool:
        """Whether nothing but fixed intrinsics is contradicted."""
        return all(name.startswith("camera[") for name in self.off)

    @classmethod
    def of(cls, words: Iterable[str], given: PictureFit, better: PictureFit, *more: str) -> "Doubts":
        """From the fit as given and the one that suits; `more` are doubted though both have them."""
        off = dict(zip(better.problem.names, better.x - better.problem.start, strict=True))
        fixed = set(off) - set(given.problem.names) | set(more)
        return cls(tuple(words), better.problem.data, {name: off[name] for name in fixed})


def find_doubts(fitted: Callable[[Dataset], PictureFit], data: Dataset) -> Doubts:
    """The given properties of camera and target that the pictures contradict.

    The pictures are fitted as given, with free intrinsics in place of fixed ones, and with a target of any
    size: what then suits them, and as given does not, is to blame; both, where the pictures can't tell.

    Args:
        fitted: Fit of what the pictures may identify of the arm, joints' zeros at most.
        data: The pictures.
    """
    rig = rig_of(data)
    any_size = replace(rig, targets=tuple(replace(t, scale_sigma=ANY_SIZE) for t in rig.targets))
    given, size = (fitted(with_rig(data, each)) for each in (rig, any_size))
    exact, is_shown = given, False
    if size.is_implausible_size(rig):
        held = replace(rig, targets=tuple(replace(t, scale_sigma=0.0) for t in rig.targets))
        exact = fitted(with_rig(data, held))
        is_shown = exact.unlikeliness - size.unlikeliness > SHOWN and size.pixel < VISIBLY * exact.pixel
    if not is_shown:
        size = given
    lens = fitted(with_rig(data, rig.with_intrinsics(Freedom.AUTO))) if rig.is_lens_fixed else given
    words = tuple(_sentences(rig, given, lens, size, exact.pixel if is_shown else None))
    minimum = min(given.pixel, lens.pixel, size.pixel)
    if _suits(given, minimum) and not (is_shown and given.is_implausible_size(rig)):
        return Doubts(words, data, {})
    is_either = is_shown and _suits(size, minimum)
    if _suits(lens, minimum) and not is_either and not (is_shown and lens.is_implausible_size(rig)):
        return Doubts.of(words, given, lens)
    return Doubts.of(words, given, size, *(f"{t.owner}.scale" for t in rig.targets))


def is_size_certain(fit: PictureFit) -> bool:
    """Whether some board is of another size whatever the arm's constants are, all of which are let go."""
    std = fit.problem.named(np.linalg.norm(factor_at(fit.problem, fit.x).root, axis=1))
    sizes = [f"{target.owner}.scale" for target in rig_of(fit.problem.data).targets]
    return any(abs(fit.values[name]) > CERTAIN * std[name] for name in sizes if name in std)


def contradicted_lens(given: PictureFit, lens: PictureFit) -> Doubts | None:
    """Fixed intrinsics that the pictures contradict, whatever the arm's constants are.

    The change d of the intrinsics that are let go, with covariance C, has dᵀC⁻¹d distributed as χ², and what
    is off comes to lie right: an effect of the arm moves intrinsics too. The pictures are then fitted without
    them, and that is said.

    Args:
        given: Fit of all that the pictures may identify of the arm, weighed by what it leaves.
        lens: The same with the intrinsics let go.
    """
    problem, rig = lens.problem, rig_of(given.problem.data)
    if _suits(given, lens.pixel) and lens.lack > BLAMED * given.lack:
        return None
    places = [k for k, name in enumerate(problem.names) if name not in given.problem.names]
    scale = problem.units[places]
    spread = factor_at(problem, lens.x).root[places] / scale[:, None]
    change = (lens.x - problem.start)[places] / scale
    if change @ np.linalg.lstsq(spread @ spread.T, change, rcond=1e-12)[0] < CONTRADICTED * len(places):
        return None
    return Doubts((_against_lens(given, lens, rig),), problem.data, {})


def _suits(fit: PictureFit, minimum: float) -> bool:
    return BETTER * fit.pixel <= minimum or fit.pixel - minimum <= MIN_PIXEL


def _sentences(
    rig: Rig, given: PictureFit, lens: PictureFit, size: PictureFit, exact: float | None
) -> Iterator[str]:
    """The doubts in words, from the fits as given, with free intrinsics and with a target of any size.

    `exact` is the error of corners [px] with just the size that was given; None where that may be right.
    """
    suits = partial(_suits, minimum=min(given.pixel, lens.pixel, size.pixel))
    is_suited, is_size = suits(given), exact is not None and given.is_implausible_size(rig)
    is_lens = bool(given.implausible_intrinsics(rig))
    if not is_suited:
        is_lens, is_size = suits(lens), exact is not None and suits(size)
        is_either = is_lens and is_size
    elif is_lens:
        is_either = exact is not None and not is_size and suits(size) and not size.implausible_intrinsics(rig)
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
            f"{text}, more than {OUTSIDE:g} times sigma from the given intrinsics; check that they are of "
            "this camera and lens"
            for text in (given if is_suited else size).implausible_intrinsics(rig)
        )
    if is_size and exact is not None:
        yield (
            f"{_larger(size, rig, 'is ')}: corners {exact:.2f} px off with "
            f"the size given, {size.pixel:.2f} px with that one; measure it and correct its sizes"
        )


def _against_lens(given: PictureFit, lens: PictureFit, rig: Rig) -> str:
    return (
        f"the given intrinsics do not suit the pictures: corners {given.pixel:.2f} px off with them, "
        f'{_by_lens(lens, rig)}; they were left free, so set free = "auto" or calibrate the camera'
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


def _size(target: PictureTarget, scale: float, verb: str) -> str:
    board, more = target.charuco, "larger" if scale > 0.0 else "smaller"
    who = f"board '{target.name}'" if target.name else "the target"
    words = f"{who} {verb}{100 * abs(scale):.2f} % {more} than its file says"
    if board is None:
        return words
    side = 1e3 * board.square
    return f"{words} (squares of {side * (1.0 + scale):.4g} mm, not {side:.4g} mm)"


def mismatched_pictures(
    robot: Robot, data: Dataset, build: Callable[..., Problem] = Problem.build
) -> dict[int, str]:
    """Rows whose picture does not suit their joints, with the reason.

    A picture counts the less in the fit the farther it is off, so that a few wrong ones don't bend it.
    """
    free = tuple(n for n in robot.joint_offsets if n in robot.default_free)
    problem = build(robot, data, free=free).with_noise(ROUGH)
    x, off = _robust_errors(problem)
    _check_mounts(robot, data, build, problem, x)
    lost = off > max(OUT_OF_LINE * float(np.median(off)), FAR_OFF)
    if not lost.any() or lost.mean() >= MAX_WRONG:
        return {}
    image = PictureReadings.of(data).image
    reasons = {
        int(i): f"image {image[i]} does not suit its joints: {1e3 * off[i]:.1f} mm off"
        for i in np.flatnonzero(lost)
    }
    for i, j in combinations(reasons, 2):
        order = np.arange(len(data))
        order[[i, j]] = j, i
        swapped = build(robot, replace(data, q=data.q[order]), free=free).with_noise(ROUGH)
        if (_errors(swapped, x)[[i, j]] <= max(OUT_OF_LINE * float(np.median(off)), FAR_OFF)).all():
            words = f"the joints of images {image[i]} and {image[j]} are exchanged"
            reasons |= {i: words, j: words}
    return reasons


def _errors(problem: Problem, x: np.ndarray) -> Float[np.ndarray, " rows"]:
    """How far off the tool seems to be in every picture [m]."""
    return Pictures.at(problem, x).errors(Noise(1.0, 1.0, (), 0.5))[0]


def _robust_errors(problem: Problem) -> tuple[np.ndarray, Float[np.ndarray, " rows"]]:
    """Answer of a fit in which pictures that are far off count less, and how far each is off [m]."""
    x, now = problem.start, problem
    for _ in range(ROBUST_ROUNDS):
        x = Opt2(limit=40).search(now, begin=x).x
        off = _errors(problem, x)
        weight = 1.0 / np.sqrt(1.0 + (off / (3.0 * np.median(off) + 1e-6)) ** 2)
        now = problem.with_row_weights(weight)
    return x, off


def _check_mounts(
    robot: Robot, data: Dataset, build: Callable[..., Problem], problem: Problem, x: np.ndarray
) -> None:
    """Refuse a rig whose camera rides where its file says that the target does."""
    if PictureFit(problem, x).pixel < EXCHANGED:
        return
    rig = rig_of(data)
    other = with_rig(data, rig.with_mounts_exchanged())
    tried = build(robot, other, free=()).with_noise(ROUGH)
    if PictureFit(tried, _robust_errors(tried)[0]).pixel < 0.5 * PictureFit(problem, x).pixel:
        raise DataError(
            f"{data.source}: the mounts are exchanged: the pictures suit a camera mounted = "
            f'"{rig.mounted}" that sees a target mounted = "{rig.cameras[0].mounted}"; correct both files'
        )

"""Contradictions between pictures, camera and target: wrong intrinsics or a wrong print size."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import INTRINSICS, ON, Camera, project
from workbench.extras.camera.pixel_noise import Pictures
from workbench.extras.camera.printed import NO_TARGET
from workbench.extras.camera.rig import PictureReadings, Rig, rig_of, with_rig
from workbench.extras.camera.target import PictureTarget
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.considered import Considered
from workbench.identification.problem import Noise, Problem

OUTSIDE = 3.0
"""Standard deviations of prior knowledge beyond which it is doubted."""
UNNOTICED = 0.3
"""Pixels by which a lens that is off may move the corners that were seen."""
OTHER_LENS, OTHER_SIZE = 30.0, 8.0
"""Twice the gain in log likelihood from which on other intrinsics, or another size, are the right ones …"""
EITHER = 0.5
"""… and part of that by other intrinsics from which on the pictures can't tell which of both is wrong."""
ANY_SIZE = 0.03
"""Standard deviation of a target's relative size where nothing is known of it."""
MIN_SIGMA = 1e-4
"""A size that counts as exact is judged as if known to this, as pictures tell it no better."""
OUT_OF_LINE, FAR_OFF = 6.0, 2e-3
"""Pictures this many times the median off, and so many m, don't suit their joints …"""
MAX_WRONG = 0.4
"""… if they are a smaller part of all."""
ROBUST_ROUNDS = 5
"""Fits in turn with pictures weighed by how far they were off."""
SUSPICIOUS, HOPELESS = 5e-3, 0.05
"""Median error [m] from which on camera and target are tried in each other's place and other joints, and from
which on pictures are refused."""
OTHER_JOINTS = 0.3
"""Part of the median error that the right joints leave at most."""
ROUGH = Noise(1e-3, 2e-3, (), 1.0)
"""Corners share what an arm that is not calibrated yet lacks."""


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
        given: The pictures, with intrinsics that are contradicted let go.
        data: The same, with sizes that are contradicted let go as well.
        off: How far these seem to be from what was given, by name.
    """

    sentences: tuple[str, ...]
    given: Dataset
    data: Dataset
    off: Mapping[str, float]

    @classmethod
    def of_size(cls, notes: Sequence[str], given: Dataset, size: PictureFit) -> "Doubts":
        """Where a target of any size suits the pictures better."""
        off = {f"{t.owner}.scale": size.scale(t) for t in rig_of(given).targets}
        return cls(tuple(notes), given, size.problem.data, off)

    def considered(self, problem: Problem, deviations: Float[np.ndarray, " p"] | float = 0.0) -> Considered:
        """What it bends, beside constants that are uncertain.

        Args:
            problem: Of `data`.
            deviations: Of each of its unknowns that is uncertain as well; 0 of the others.
        """
        off = np.array([abs(self.off.get(name, 0.0)) for name in problem.names])
        return Considered(problem, off + deviations)


def find_doubts(
    fitted: Callable[[Dataset], PictureFit], plain: Callable[[Dataset], PictureFit], data: Dataset
) -> Doubts:
    """The given properties of camera and target that the pictures contradict, whatever the arm is.

    The pictures are fitted as given, with free intrinsics in place of fixed ones, and with a target of any
    size. What is given is doubted where another is far likelier, all else that is unknown averaged out: what
    the arm lacks moves intrinsics and sizes too. Sizes are doubted with intrinsics that were let go.

    Args:
        fitted: Fit of all that the pictures may identify of the arm, weighed by what it leaves.
        plain: Fit of the joints' zeros with all corners weighed alike, for the words.
        data: The pictures, with the intrinsics let go where they are doubted.
    """
    rig = rig_of(data)
    notes: list[str] = []
    given, size = fitted(data), fitted(_of_any_size(data))
    if rig.is_lens_fixed:
        let_go = with_rig(data, rig.with_intrinsics(Freedom.AUTO))
        lens = fitted(let_go)
        by_lens, by_size = given.less_likely_than(lens), given.less_likely_than(size)
        if by_lens > OTHER_LENS and by_size > max(OTHER_SIZE, EITHER * by_lens):
            notes.append(
                "the target's size or the focal length is wrong, and the pictures can't determine which: "
                f"{_by_size(plain, data)}, {_by_lens(plain(let_go), rig)}; check the printed square's side, "
                'or leave the intrinsics to be refined with free = "auto"'
            )
            return Doubts.of_size(notes, data, size)
        if by_lens > max(OTHER_LENS, by_size):
            notes.append(
                f"the given intrinsics do not fit the pictures: corners are {given.pixel:.2f} px off with "
                "them, "
                f'{_by_lens(lens, rig)}; they were left free, so set free = "auto" or calibrate the camera'
            )
            data, given, size = let_go, lens, fitted(_of_any_size(let_go))
    is_strange = any(size.strangeness(target) > OUTSIDE for target in rig.targets)
    is_other = is_strange and given.less_likely_than(size) > OTHER_SIZE
    notes += [
        f"{far}, more than {OUTSIDE:g} times sigma from the given intrinsics; check that they belong to "
        "this camera and lens"
        for far in (size if is_other else given).implausible_intrinsics(rig)
    ]
    if not is_other:
        return Doubts(tuple(notes), data, data, {})
    off = _by_size(plain, data, "that one")
    notes.append(f"{_larger(size, rig, 'is ')}: {off}; measure it and correct its sizes")
    return Doubts.of_size(notes, data, size)


def _of_any_size(data: Dataset, sigma: float = ANY_SIZE) -> Dataset:
    """The pictures with targets whose sizes are known to sigma."""
    rig = rig_of(data)
    return with_rig(data, replace(rig, targets=tuple(replace(t, scale_sigma=sigma) for t in rig.targets)))


def _by_size(plain: Callable[[Dataset], PictureFit], data: Dataset, other: str = "") -> str:
    """What another size leaves, which is named if `other` doesn't."""
    exact, size = plain(_of_any_size(data, 0.0)), plain(_of_any_size(data))
    other = other or _larger(size, rig_of(data))
    return f"corners {exact.pixel:.2f} px off with the size given, {size.pixel:.2f} px with {other}"


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
    text = f"{who} {verb}{100 * abs(scale):.2f} % {more} than stated"
    if board is None:
        return text
    side = 1e3 * board.square
    return f"{text} (squares of {side * (1.0 + scale):.4g} mm, not {side:.4g} mm)"


def mismatched_pictures(
    robot: Robot, data: Dataset, build: Callable[..., Problem] = Problem.build
) -> dict[int, str]:
    """Rows whose picture does not suit their joints, with the reason.

    A picture counts the less in the fit the farther it is off, so that a few wrong ones don't bend it.

    Raises:
        DataError: all suit a rig whose camera and target have changed places, or joints a row away or with
            one reversed, or most suit nothing.
    """
    free = tuple(n for n in robot.joint_offsets if n in robot.default_free)

    def fitted(rows: Dataset) -> tuple[Problem, np.ndarray, np.ndarray]:
        problem = build(robot, rows, free=free).with_noise(ROUGH)
        return problem, *_robust_errors(problem)

    problem, x, off = fitted(data)
    usual = float(np.median(off))
    if usual > SUSPICIOUS:
        _check_mounts(robot, data, build, problem, x)
        for text, q in _other_joints(data):
            if np.median(fitted(replace(data, q=q))[2]) < OTHER_JOINTS * usual:
                raise DataError(f"{data.source}: {text}")
    if usual > HOPELESS:
        raise DataError(
            f"{data.source}: the pictures don't fit their joint readings: with the best poses of camera and "
            f"target, half of them are {1e3 * usual:.0f} mm off or more; check the order of the rows, the "
            "order, units and signs of the joints, and the robot"
        )
    limit = max(OUT_OF_LINE * usual, FAR_OFF)
    lost = off > limit
    if not lost.any() or lost.mean() >= MAX_WRONG:
        return {}
    image = PictureReadings.of(data).image
    reasons = {
        int(i): f"image {image[i]} does not fit its joint readings: {1e3 * off[i]:.1f} mm off"
        for i in np.flatnonzero(lost)
    }
    for i, j in combinations(reasons, 2):
        order = np.arange(len(data))
        order[[i, j]] = j, i
        swapped = build(robot, replace(data, q=data.q[order]), free=free).with_noise(ROUGH)
        if (_errors(swapped, x)[[i, j]] <= limit).all():
            text = f"the joints of images {image[i]} and {image[j]} are exchanged"
            reasons |= {i: text, j: text}
    return reasons


def _other_joints(data: Dataset) -> Iterator[tuple[str, Float[np.ndarray, "rows n"]]]:
    """What joints may be in place of those of the file, in words and as numbers."""
    for ahead, word in ((1, "before"), (-1, "after")):
        yield (
            f"each picture fits the joints of the row {word} its own; correct the order of the joints, or "
            "the names of their pictures",
            np.roll(data.q, ahead, axis=0),
        )
    for joint in range(data.joints):
        yield (
            f"joint {joint + 1} counts backwards: the pictures fit its readings with the opposite sign; "
            "correct its column, or the robot",
            data.q * np.where(np.arange(data.joints) == joint, -1.0, 1.0),
        )


def _errors(problem: Problem, x: np.ndarray) -> Float[np.ndarray, " rows"]:
    """How far off every picture's corners are, where the target is [m, root mean square]."""
    pictures = Pictures.at(problem, x)
    slope = np.einsum("rii->r", pictures.normal[:, :3, :3])
    return np.sqrt(2.0 * pictures.square / np.maximum(slope, 1e-12))


def _robust_errors(problem: Problem) -> tuple[np.ndarray, Float[np.ndarray, " rows"]]:
    """Answer of a fit in which pictures that are far off count less, and how far each is off [m]."""
    x = problem.start
    for _ in range(ROBUST_ROUNDS):
        off = _errors(problem, x)
        weight = 1.0 / np.sqrt(1.0 + (off / (3.0 * np.median(off) + 1e-6)) ** 2)
        x = Opt2(limit=40).search(problem.with_row_weights(weight), begin=x).x
    return x, _errors(problem, x)


def _check_mounts(
    robot: Robot, data: Dataset, build: Callable[..., Problem], problem: Problem, x: np.ndarray
) -> None:
    """Refuse a rig whose camera rides where its file says that the target does."""
    rig = rig_of(data)
    other = with_rig(data, rig.with_mounts_exchanged())
    tried = build(robot, other, free=()).with_noise(ROUGH)
    if PictureFit(tried, _robust_errors(tried)[0]).pixel < 0.5 * PictureFit(problem, x).pixel:
        board, camera = ON[rig.cameras[0].mounted], ON[rig.mounted]
        is_asked = any(note.startswith(NO_TARGET) for note in data.notes)
        mend = "change 'Board is'" if is_asked else "exchange 'mounted' in target.toml and camera.toml"
        raise DataError(
            f"{data.source}: the mounts are exchanged: the board is {board} and the camera {camera}; {mend} "
            "and read the pictures again"
        )

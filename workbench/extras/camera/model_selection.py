"""What of an arm its pictures may identify: joint zeros and geometry are let go only if that is far likelier.

Camera and target are fitted alone, then with the joints' zeros, then with the arm's geometry. A step is taken
if its evidence, twice the gain in log likelihood (`Likelihood`) by letting its constants go, is so much for
each picture, on average. All pictures are weighed together, so that two halves of them decide alike. The same
likelihood doubts what was given: fixed intrinsics that are contradicted, or a target of another size, end the
identification, as the arm would be distorted to compensate.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import INTRINSICS
from workbench.extras.camera.findings import Identifiability, Step, identifiability
from workbench.extras.camera.likelihood import MIN_SIZE, WIDTH, Likeliest, Likelihood
from workbench.extras.camera.rig import rig_of, with_rig
from workbench.extras.camera.target import PictureTarget
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.consider_covariance import Considered
from workbench.identification.problem import Noise, Problem

ALONE, ZEROS, GEOMETRY = "camera and target alone", "joint zeros", "geometry"
NEEDED, MIN_EVIDENCE = {ZEROS: 1.0, GEOMETRY: 2.0}, 12.0
"""Evidence that each picture must add on average, and all of them together."""
ROUNDS = 3
"""Fits between which the sizes are estimated anew."""
CONFOUNDED = 1e-5
"""A constant whose column is this small after removing that of camera and target can't be separated from
them."""
OUTSIDE = 3.0
"""Standard deviations of prior knowledge beyond which it is doubted."""
OTHER_LENS, OTHER_SIZE, EITHER = 30.0, 8.0, 0.5
"""Evidence from which on given intrinsics, or a size, are wrong; and part of that of the lens from which on
the pictures can't tell which of both is."""
ANY_SIZE, EXACT_SIZE = 0.03, 1e-4
"""Relative size of a target of which nothing is known, and of one that counts as exact [σ]."""
HELD = 1e-3
"""Part of their own σ to which intrinsics are held."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A step's fit.

    Args:
        problem: Weighed, with the geometry's scatter about nominal as prior knowledge.
        likelihood: At the answer; its first group is the geometry.
    """

    problem: Problem
    likelihood: Likelihood

    @property
    def free(self) -> tuple[str, ...]:
        """Constants of the arm that it frees."""
        return tuple(p.name for p in self.problem.parameters if p.is_geometry)

    @cached_property
    def found(self) -> Likeliest:
        return self.likelihood.likeliest()


def select_camera_step(
    robot: Robot, data: Dataset, *, free: Sequence[str], build: Callable[..., Problem] = Problem.build
) -> tuple[Problem, Identifiability]:
    """The weighed problem of the last step that is taken, and why.

    Args:
        free: Constants of the arm that may be freed at all.
        build: Makes the problem from robot, data and `free`.
    """
    offsets = [n for n in robot.joint_offsets if n in free]
    hidden = _confounded(build(robot, data, free=offsets)) if offsets else set()
    zeros = tuple(n for n in offsets if n not in hidden)
    groups = {ZEROS: zeros, GEOMETRY: tuple(n for n in free if n not in hidden)}
    names = {k: own for k, own in groups.items() if own and len(own) <= 4 * len(data)}
    if names.get(GEOMETRY) == zeros:
        del names[GEOMETRY]

    def fitted(rows: Dataset, own: tuple[str, ...]) -> Fitted:
        return _fitted(build(robot, rows, free=own), [n for n in own if n not in zeros])

    rig, auto = rig_of(data), {Freedom.FIXED: Freedom.AUTO}  # of intrinsics and sizes little is known
    cameras = tuple(replace(c, free=auto.get(c.free, c.free)) for c in rig.cameras)
    targets = tuple(replace(t, scale_sigma=ANY_SIZE) for t in rig.targets)
    loose = fitted(
        with_rig(data, replace(rig, cameras=cameras, targets=targets)),
        names.get(GEOMETRY, names.get(ZEROS, ())),
    )
    doubt = find_doubt(loose, data)
    fits = [_alike(build(robot, data, free=()))]
    fits += [fitted(data, own) for own in names.values() if not doubt]
    taken, steps = fits[0], list[Step]()
    for name, each in zip((ALONE, *names), fits, strict=False):
        steps.append(_step(name, each, zeros))
        taken = taken if steps[-1].refused else each
    number, considered, last = fits.index(taken), None, fits[-1]
    if len(last.free) > len(taken.free):  # geometry stays as given though it is uncertain
        sigma = last.likelihood.mean(WIDTH) * last.likelihood.groups[0]
        considered = Considered(last.problem.with_noise(taken.problem.noise), sigma)
    decided = identifiability(
        steps,
        number,
        taken.found.noise,
        doubts=(doubt,) if doubt else (),
        actual=None if taken.free else taken.found.noise,
        considered=considered,
    )
    return taken.problem, decided


def _shares(problem: Problem, names: Collection[str]) -> Float[np.ndarray, " p"]:
    """Standard deviation of some unknowns by which a tool would move by about 1 m; 0 of the others."""
    reach = max(problem.robot.reach / 2.0, 0.1)
    own = ((1.0 / reach if p.unit == "rad" else 1.0) if p.name in names else 0.0 for p in problem.parameters)
    return np.array([*own])


def _alike(problem: Problem) -> Fitted:
    """Fit of camera and target alone, all corners weighed alike: what they leave tells of the arm."""
    problem = problem.with_noise(Noise(0.0, 0.0, (), problem.noise.own))
    x = Opt2(limit=60).search(problem).x
    return Fitted(problem, Likelihood.at(problem, x))


def _fitted(problem: Problem, shrunk: Sequence[str]) -> Fitted:
    """Fit and sizes in turns; the shrunk constants scatter about nominal as widely as is likely."""
    shares, width = _shares(problem, shrunk), 3e-4
    inside = shares > 0.0
    names = np.array(problem.names)[inside].tolist()
    noise, x = Noise(1e-3, 2e-3), problem.start
    for _ in range(ROUNDS):
        now = problem.with_noise(noise)
        if shrunk:
            wall = np.diag(1.0 / (max(width, MIN_SIZE[WIDTH]) * shares[inside]))
            now = now.with_prior(names, problem.start[inside], wall)
        x = Opt2(limit=60).search(now, begin=x).x
        likelihood = Likelihood.at(problem, x, shares)
        found = likelihood.likeliest()
        noise, width = found.noise, found.sizes[WIDTH]
    return Fitted(now.with_noise(noise), likelihood)


def _confounded(problem: Problem) -> set[str]:
    """Constants of the arm that camera and target can do as well, such as the first joint's zero."""
    jacobian = problem.evaluate(problem.start).jacobian * problem.units
    arm = np.array([p.is_geometry for p in problem.parameters])
    q, _ = np.linalg.qr(jacobian[:, ~arm])
    left = jacobian[:, arm] - q @ (q.T @ jacobian[:, arm])
    small = np.linalg.norm(left, axis=0) < CONFOUNDED * np.linalg.norm(jacobian[:, arm], axis=0)
    return set(np.array(problem.names)[arm][small].tolist())


def find_doubt(loose: Fitted, data: Dataset) -> str:
    """What the pictures contradict of camera and target as given, whatever the arm is; "" if nothing.

    Args:
        loose: Fit of all that the pictures may identify of the arm, of intrinsics and sizes.
        data: The pictures with both as given.
    """
    rig, problem = rig_of(data), loose.problem
    fixed = [camera for camera in rig.cameras if camera.free is Freedom.FIXED]
    sigmas = {t: max(t.scale_sigma, EXACT_SIZE) for t in rig.targets if f"{t.owner}.scale" in problem.names}
    lens = {
        f"{c.owner}.{part}": s for c in fixed for part, s in zip(INTRINSICS, c.sigma.tolist(), strict=True)
    }
    size = {f"{target.owner}.scale": sigma for target, sigma in sigmas.items()}
    groups = (np.array([own.get(name, 0.0) for name in problem.names]) for own in (lens, size))
    likelihood = replace(loose.likelihood, groups=(*loose.likelihood.groups, *groups))

    def likeliest(lens: float = HELD if fixed else np.inf, size: float = 1.0) -> Likeliest:
        return likelihood.likeliest({WIDTH + 1: lens, WIDTH + 2: size})

    given, by_size, by_lens = likeliest(), likeliest(size=np.inf), likeliest(lens=np.inf)
    text, strange = _larger(sigmas, problem, by_size)
    gain, gain_of_lens = given.cost - by_size.cost, given.cost - by_lens.cost
    if gain_of_lens > OTHER_LENS:
        values = problem.named(by_lens.x)
        found = ", ".join(f"{k} {values[f'{fixed[0].owner}.{k}']:.4g}" for k in INTRINSICS[:5])
        is_either = gain > max(OTHER_SIZE, EITHER * gain_of_lens)
        rest = f", or {text}; check both" if is_either else ': set free = "auto" or calibrate the camera'
        return f"the given intrinsics do not fit the pictures (camera {fixed[0].name}: {found}){rest}"
    return f"{text}; measure it and correct its sizes" if strange > OUTSIDE and gain > OTHER_SIZE else ""


def _larger(sigmas: dict[PictureTarget, float], problem: Problem, found: Likeliest) -> tuple[str, float]:
    """How much larger or smaller the strangest board is than stated, and by how many standard deviations."""
    if not sigmas:
        return "", 0.0
    at = {target: problem.names.index(f"{target.owner}.scale") for target in sigmas}
    target = max(sigmas, key=lambda t: abs(found.x[at[t]]) / sigmas[t])
    scale, std = found.x[at[target]], np.sqrt(found.covariance[at[target], at[target]])
    who = f"board '{target.name}'" if target.name else "the target"
    by = f"{100 * abs(scale):.2f} % {'larger' if scale > 0.0 else 'smaller'} than stated"
    return f"{who} is {by} (± {100 * std:.2g} %, one standard error)", abs(scale) / sigmas[target]


def _step(name: str, at: Fitted, zeros: Collection[str]) -> Step:
    """A step's evidence, and the reason where it is not taken."""
    evidence, refused = 0.0, ""
    if name != ALONE:
        own = _shares(at.problem, zeros) if name == ZEROS else at.likelihood.groups[0]
        evidence = replace(at.likelihood, groups=(own,)).evidence()
        needed = max(NEEDED[name] * len(at.problem.data), MIN_EVIDENCE)
        if evidence < needed:
            rise = f"twice the log likelihood rises by {evidence:.1f}, {needed:.0f} are needed"
            refused = f"weak evidence in the pictures: {rise}"
    return Step(name, at.free, at.likelihood.pictures.pixel, evidence, refused)

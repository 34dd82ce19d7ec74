"""What of an arm its pictures may identify: joint zeros and geometry are let go only if that is far likelier.

All is fitted together once, intrinsics and sizes too, and the likelihood there weighs what is held: joint
zeros, then geometry, are let go if their evidence, twice the gain in log likelihood, is so much for each
picture, on average. All pictures are weighed together, so that two halves of them decide alike. The same
likelihood doubts what was given: fixed intrinsics that are contradicted, or a target of another size, end
the identification, as the arm would be distorted to compensate. What is taken is then fitted by itself.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import INTRINSICS
from workbench.extras.camera.likelihood import MIN_SIZE, WIDTH, Likeliest, Likelihood
from workbench.extras.camera.observation import POSE, Placed
from workbench.extras.camera.rig import owner_in, rig_of, with_rig
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.consider_covariance import Considered
from workbench.identification.fit import Fit
from workbench.identification.instrument_preparation import AbstractIdentifiability
from workbench.identification.problem import Noise, Problem
from workbench.report.json import Json

ALONE, ZEROS, GEOMETRY = "camera and target alone", "joint zeros", "geometry"
NEEDED, MIN_EVIDENCE = {ALONE: 0.0, ZEROS: 1.0, GEOMETRY: 2.0}, 12.0
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
ARM_OR_SIZE = 0.3
"""Part of the evidence of all the geometry from which on one size, too, may be what is off: a tag printed
1.5 % too small had 0.4 of that of 22 constants, which it moved by up to 6 mm."""
OR_ARM = ", or the arm's geometry is off, the pictures can't tell which"
CORRECT = "measure it and correct its sizes"
ANY_SIZE, EXACT_SIZE = 0.03, 1e-4
"""Relative size of a target of which nothing is known, and of one that counts as exact [σ]."""
FIXED, HELD, LET_GO = float(MIN_SIZE[WIDTH]), 1e-3, np.inf
"""Widths of constants of the arm, and of intrinsics, that stay as given, and of what is free."""
TAKE_MORE = "to decide, take more pictures, with the joints turned further and the target near and tilted"


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Identifiability(AbstractIdentifiability):
    """What was decided, as the JSON result has it."""

    decided: Json

    def found(self, fit: Fit) -> Iterator[str]:
        """Where each camera and the target are."""
        for name, pose in _poses(fit).items():
            xyz = ", ".join(f"{1e3 * v:.2f}" for v in pose["xyz"])
            rpy = ", ".join(f"{v:.3f}" for v in pose["rpy_deg"])
            place = f"xyz {xyz} mm ± {max(pose['xyz_std_mm']):.2g}"
            turn = f"rpy {rpy}° ± {max(pose['rotation_std_deg']):.2g}"
            yield f"{name} on the {pose['mounted']}: {place}, {turn} (one standard error)"

    def json(self, fit: Fit) -> Json:
        apart = [vars(corner) for corner in rig_of(fit.problem.data).rejected]
        return {"camera": self.decided | {"poses": _poses(fit), "set_apart": apart}}


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
    names: dict[str, tuple[str, ...]] = {ALONE: ()}
    names |= {k: own for k, own in groups.items() if 0 < len(own) <= 4 * len(data)}
    if names.get(GEOMETRY) == zeros:
        del names[GEOMETRY]
    every = [*names.values()][-1]
    shrunk = set(every) - set(zeros)
    together, likelihood = _together(build(robot, _loosened(data), free=every), zeros, shrunk, data)
    given = {"zeros": LET_GO, "lens": HELD if likelihood.groups["lens"].any() else LET_GO, "size": 1.0}
    held, less = given | {"geometry": FIXED}, {k: v for k, v in given.items() if k != "zeros"}
    found = {ALONE: likelihood.likeliest(**held | {"zeros": FIXED}), GEOMETRY: likelihood.likeliest(**given)}
    found[ZEROS] = likelihood.likeliest(**less, geometry=FIXED)
    gains = {ALONE: 0.0, ZEROS: found[ALONE].cost - found[ZEROS].cost}
    gains[GEOMETRY] = likelihood.likeliest(**held).cost - found[GEOMETRY].cost
    doubt = find_doubt(together, likelihood, given, data)
    taken, steps = ALONE, list[Json]()
    for name in [ALONE] if doubt else names:
        refused = _refused(gains[name], NEEDED[name] * len(data))
        taken = taken if refused else name
        step = {"name": name, "taken": not refused, "reason": refused, "free": names[name]}
        steps.append(step | {"fitted_px": found[name].pixel, "evidence": max(gains[name], 0.0)})
    own, considered = names[taken], None
    problem = build(robot, data, free=own)
    if own:
        problem, alone = _fitted(problem, shrunk & set(own))
    else:  # all corners weighed alike: what camera and target leave tells of the arm
        problem = problem.with_noise(Noise(0.0, 0.0, (), problem.noise.own))
        alone = Likelihood.at(problem, Opt2(limit=60).search(problem).x)
    noise = alone.likeliest().noise
    steps[[*names].index(taken)]["fitted_px"] = alone.pictures.pixel(0.0 * alone.x)
    if len(every) > len(own) and not doubt:  # geometry stays as given though it is uncertain
        whole = build(robot, data, free=every).with_noise(problem.noise)
        considered = Considered(whole, likelihood.mean("geometry", **given) * _shares(whole, shrunk))
    return problem, identifiability(steps, noise, doubt, actual=None if own else noise, considered=considered)


def _loosened(data: Dataset) -> Dataset:
    """The pictures where little is known of intrinsics and sizes."""
    rig, auto = rig_of(data), {Freedom.FIXED: Freedom.AUTO}
    cameras = tuple(replace(c, free=auto.get(c.free, c.free)) for c in rig.cameras)
    targets = tuple(replace(t, scale_sigma=ANY_SIZE) for t in rig.targets)
    return with_rig(data, replace(rig, cameras=cameras, targets=targets))


def _together(
    problem: Problem, zeros: Sequence[str], shrunk: Collection[str], data: Dataset
) -> tuple[Problem, Likelihood]:
    """Fit of all that the pictures may identify, with groups for all that may be held there."""
    rig, (problem, found) = rig_of(data), _fitted(problem, shrunk)
    fixed = [camera for camera in rig.cameras if camera.free is Freedom.FIXED]
    lens = {f"{c.owner}.{k}": s for c in fixed for k, s in zip(INTRINSICS, c.sigma.tolist(), strict=True)}
    sizes = {f"{t.owner}.scale": max(t.scale_sigma, EXACT_SIZE) for t in rig.targets}
    given = (("lens", lens), ("size", sizes))
    own = {k: np.array([part.get(n, 0.0) for n in problem.names]) for k, part in given}
    return problem, replace(found, groups={**found.groups, "zeros": _shares(problem, zeros), **own})


def _refused(evidence: float, needed: float) -> str:
    """Why a step is not taken; "" if it is."""
    if not needed or evidence >= (needed := max(needed, MIN_EVIDENCE)):
        return ""
    rise = f"twice the log likelihood rises by {max(evidence, 0.0):.1f}, {needed:.0f} are needed"
    return f"weak evidence in the pictures: {rise}"


def _shares(problem: Problem, names: Collection[str]) -> Float[np.ndarray, " p"]:
    """Standard deviation of some unknowns by which a tool would move by about 1 m; 0 of the others."""
    reach = max(problem.robot.reach / 2.0, 0.1)
    own = ((1.0 / reach if p.unit == "rad" else 1.0) if p.name in names else 0.0 for p in problem.parameters)
    return np.array([*own])


def _fitted(problem: Problem, shrunk: Collection[str]) -> tuple[Problem, Likelihood]:
    """Fit and sizes in turns; the shrunk constants scatter about nominal as widely as is likely."""
    shares, width = _shares(problem, shrunk), 3e-4
    inside = shares > 0.0
    names = np.array(problem.names)[inside].tolist()
    noise, x = Noise(1e-3, 2e-3), problem.start
    for _ in range(ROUNDS):
        now = problem.with_noise(noise)
        if shrunk:
            wall = np.diag(1.0 / (max(width, FIXED) * shares[inside]))
            now = now.with_prior(names, problem.start[inside], wall)
        x = Opt2(limit=60).search(now, begin=x).x
        likelihood = Likelihood.at(problem, x, geometry=shares)
        found = likelihood.likeliest()
        noise, width = found.noise, found.sizes[WIDTH]
    return now.with_noise(noise), likelihood


def _confounded(problem: Problem) -> set[str]:
    """Constants of the arm that camera and target can do as well, such as the first joint's zero."""
    jacobian = problem.evaluate(problem.start).jacobian * problem.units
    arm = np.array([p.is_geometry for p in problem.parameters])
    q, _ = np.linalg.qr(jacobian[:, ~arm])
    left = jacobian[:, arm] - q @ (q.T @ jacobian[:, arm])
    small = np.linalg.norm(left, axis=0) < CONFOUNDED * np.linalg.norm(jacobian[:, arm], axis=0)
    return set(np.array(problem.names)[arm][small].tolist())


def find_doubt(problem: Problem, likelihood: Likelihood, given: Mapping[str, float], data: Dataset) -> str:
    """What the pictures contradict of camera and target as given, whatever the arm is; "" if nothing.

    Args:
        problem: The fit of all that the pictures may identify.
        likelihood: Its own, with all groups.
        given: Their widths where intrinsics and sizes are as given.
        data: The pictures.
    """
    sigma = likelihood.groups["size"]
    held = {**given, "geometry": FIXED}
    found, nominal = likelihood.likeliest(**given), likelihood.likeliest(**held)
    by_lens = likelihood.likeliest(**{**given, "lens": LET_GO})
    by_size, resized = (likelihood.likeliest(**{**pins, "size": LET_GO}) for pins in (given, held))
    text, strange, gain = _larger(problem, sigma, by_size, found)
    if (gain_of_lens := found.cost - by_lens.cost) > OTHER_LENS:
        owner = next(c for c in rig_of(data).cameras if c.free is Freedom.FIXED)
        values = problem.named(by_lens.x)
        shown = ", ".join(f"{k} {values[f'{owner.owner}.{k}']:.4g}" for k in INTRINSICS[:5])
        is_either = gain > max(OTHER_SIZE, EITHER * gain_of_lens)
        rest = f", or {text}; check both" if is_either else ': set free = "auto" or calibrate the camera'
        return f"the given intrinsics do not fit the pictures (camera {owner.name}: {shown}){rest}"
    if strange > OUTSIDE and gain > OTHER_SIZE:
        return f"{text}; {CORRECT}"
    text, strange, gain = _larger(problem, sigma, resized, nominal)
    is_either = strange > OUTSIDE and gain > max(OTHER_SIZE, ARM_OR_SIZE * (nominal.cost - found.cost))
    return f"{text}{OR_ARM}; {CORRECT}" if is_either else ""


def _larger(
    problem: Problem, sigma: Float[np.ndarray, " p"], found: Likeliest, stated: Likeliest
) -> tuple[str, float, float]:
    """How much larger or smaller the strangest board is found than stated, by how many standard deviations,
    and the evidence."""
    if not sigma.any():
        return "", 0.0, 0.0
    off = np.abs(found.x) / np.where(sigma > 0.0, sigma, np.inf)
    k = int(off.argmax())
    scale, std = found.x[k], np.sqrt(found.covariance[k, k])
    board = problem.names[k].removeprefix("target").removesuffix(".scale")  # in brackets, if it has a name
    who = f"board '{board[1:-1]}'" if board else "the target"
    by = f"{100 * abs(scale):.2f} % {'larger' if scale > 0.0 else 'smaller'} than stated"
    text = f"{who} is {by} (± {100 * std:.2g} %, one standard error)"
    return text, off[k], stated.cost - found.cost


def identifiability(steps: Sequence[Json], noise: Noise, doubt: str, **more: Any) -> Identifiability:
    """What the steps that were tried decide, the last one taken, and how corners and tool scatter."""
    title = [step["name"] for step in steps if step["taken"]][-1]
    lost, doubts = {s["name"]: s["reason"] for s in steps if s["reason"]}, (doubt,) if doubt else ()
    advice, pixel = [TAKE_MORE] * bool(lost), np.sqrt(2.0) * noise.own
    reasons = "; ".join([*doubts, *(f"{name}: {reason}" for name, reason in lost.items()), *advice])
    unknown = "it has no constant that these pictures could determine"
    refused = (reasons or unknown) if title == ALONE else ""
    decided = {"step": title, "identified": title != ALONE, "refused": refused}
    decided |= {"measure_next": "".join(advice), "steps": steps}
    decided |= {"noise": {"pixel_px": pixel, **noise.json()}}
    notes = [*(f"{name} not taken: {reason}" for name, reason in lost.items()), *advice]
    lack = f"{1e3 * noise.position:.3f} mm, {np.rad2deg(noise.rotation):.3f}°"
    lacking = f"what the model lacks of the tool's pose {lack} about each axis"
    notes.append(f"noise from the pictures: corners {pixel:.2f} px; {lacking}")
    told = {"title": title, "refused": refused, "advice": "".join(advice), "notes": tuple(notes)}
    return Identifiability(**told, **more, doubts=doubts, decided=decided)


def _poses(fit: Fit) -> Json:
    """Pose of every camera and of the target in what carries it, standard errors about that one's axes."""
    rig, names = rig_of(fit.problem.data), fit.problem.names
    found: Json = {}
    sessions = fit.problem.data.sessions
    owners = {owner_in(part, s): (part, s) for part in rig.posed for s in sessions}
    for name, (part, session) in owners.items():
        if f"{name}.x" not in names:
            continue
        places = [names.index(f"{name}.{axis}") for axis in POSE]
        placed = Placed.at(fit.x[places])
        turn = placed.turning @ fit.covariance[np.ix_(places[3:], places[3:])] @ placed.turning.T
        rpy, angles = se3.matrix_to_rpy(placed.pose[:3, :3]), np.sqrt(np.maximum(np.diag(turn), 0.0))
        found[name] = {"mounted": str(part.mounted)} | ({"session": session} if name != part.owner else {})
        found[name] |= {"xyz": placed.pose[:3, 3], "rpy_deg": np.rad2deg(rpy)}
        found[name] |= {"quat_wxyz": se3.matrix_to_quaternion(placed.pose[:3, :3])}
        found[name] |= {"xyz_std_mm": 1e3 * fit.std[places[:3]], "rotation_std_deg": np.rad2deg(angles)}
    return found

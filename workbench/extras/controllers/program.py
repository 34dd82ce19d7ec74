"""The Python file that corrects joints: `standalone.py`, with the arm and its effects filled in.

Effects are numpy expressions with their numbers in them, one for each element of the chain that changes:

    q, frames, payload, temperature, direction    joints, frames of the undeflected arm, state; a row for each
    w                                             wrenches through the joints, of effects that loads drive
"""

from collections.abc import Iterable
from importlib.resources import files
from typing import Any, final

import numpy as np
from scipy.interpolate import CubicSpline

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import turns
from workbench.arm.effects.gravity_sag import PAYLOAD
from workbench.arm.effects.valid_range import FADING_KNOTS
from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.wrenches import masses, mounts
from workbench.arm.usable_arm import usable_arm
from workbench.base.errors import OptionError
from workbench.exports.export_format import AbstractForm, Job
from workbench.identification.errors.comparable_arms import comparable


@final
class PythonModule(AbstractForm):
    """A program that computes with the whole calibrated model."""

    name = "python-module"
    title = "Python file (numpy) that corrects joints and poses, with all effects"
    ending = ".py"
    takes_calibrated = True

    def write(self, job: Job) -> str:
        arms = comparable(job.robot, job.require_nominal(self.name))
        robot = arms.calibrated
        code: dict[bool, list[str]] = {False: [], True: []}
        for effect in robot.effects:
            code[bool(effect.loads)] += [f"({e}, {change})" for e, change in code_of(effect, robot.chain)]
        weights: list[tuple] = []
        if code[True]:
            if not robot.has_masses:
                raise OptionError(
                    f"--for {self.name}: effects of '{robot.name}' need the moments of its joints, but not "
                    "all masses are known; add 'mass' and 'com' to each [[joint]]",
                    option="--for",
                    found=self.name,
                )
            w = masses(robot)
            weights = list(zip(w.after.tolist(), w.mass.tolist(), w.com.tolist(), strict=True))
        arm = {
            "name": robot.name,
            "task": int(arms.task),
            "weight": ROTATION_WEIGHT * compile_arm(robot).length,
            "limits": robot.limits.tolist(),
            "base": usable_arm(job.robot).robot.base.pose.tolist(),
            "chain": _chain(robot),
            "nominal": _chain(arms.nominal),
            "driven": [*robot.chain.driven.tolist(), *robot.chain.followers.tolist()],
            "columns": robot.chain.positions(np.eye(robot.dof)).T.tolist(),
            "mounts": mounts(robot).tolist(),
            "gravity": robot.gravity.tolist(),
            "masses": weights,
            "needs": [n for n in ("temperature", "direction") if any(n in each for each in code[False])],
        }
        entries = [f"{key!r}: {value!r}".replace("inf", 'float("inf")') for key, value in arm.items()]
        text = files(__package__).joinpath("standalone.py").read_text(encoding="utf-8")
        for place, lines in (("{}  # arm", entries), ("[]  # rest", code[False]), ("[]  # load", code[True])):
            filled = "\n".join([place[0], *(f"    {each}," for each in lines), place[1]])
            text = text.replace(place, filled, 1)
        return text

    def read(self, text: str, job: Job) -> Robot | None:
        return None

    def notes(self, job: Job) -> Iterable[str]:
        yield from comparable(job.robot, job.require_nominal(self.name)).notes
        yield 'poses are in the robot\'s base, which is ARM["base"] in the measuring frame; loads are at rest'


def _chain(robot: Robot) -> list[tuple]:
    """Axis, driving joint with its ratio, value and constant matrix of each element."""
    return [
        (
            int(e.axis),
            *((e.follows, e.ratio) if e.follows is not None else (-1 if e.joint is None else e.joint, 1.0)),
            value,
            None if e.matrix is None else e.matrix.tolist(),
        )
        for e, value in zip(robot.chain.elements, robot.chain.values.tolist(), strict=True)
    ]


def code_of(effect: Any, chain: Chain) -> list[tuple[int, str]]:
    """Elements, and the expressions that are added to them; `Any`, as each effect has settings of its own."""
    elements = chain.indices(effect.elements(chain)).tolist()
    c, at = [float(size) for size in effect.coefficients], [f"q[:, {j}]" for j in effect.joints]
    w = [f"w[:, {j}, {part}]" for j, part in effect.components(chain).tolist()]
    by_load = list(zip(np.repeat(c, len(w) // len(c)).tolist(), w, strict=True))
    match effect.name:
        case "joint-compliance" | "bearing-compliance":
            code = [f"{-size!r} * {load}" for size, load in by_load]
        case "backlash" if effect.by == "motion":
            pairs = zip(c, effect.joints, strict=True)
            code = [f"{-size!r} * np.sign(direction[:, {j}])" for size, j in pairs]
        case "backlash":
            law = f"np.tanh({{}} / {effect.width!r})" if effect.width else "np.sign({})"
            code = [f"{-size!r} * {law.format(load)}" for size, load in by_load]
        case "clearance-tilt":
            code = [f"{-size!r} * _share({load}, {w[k ^ 1]})" for k, (size, load) in enumerate(by_load)]
        case "link-flexure":
            code = [_flexed(k, by_load, effect.joints[k // 2], chain) for k in range(len(w))]
        case "encoder-scale":
            code = [f"{size!r} * {q}" for size, q in zip(c, at, strict=True)]
        case "joint-coupling":
            code = [f"{c[0]!r} * {at[1]}"]
        case "joint-harmonic":
            waves = [f"{wave}({k} * {{q}})" for k in effect.orders for wave in ("np.cos", "np.sin")]
            sizes = np.reshape(c, (len(at), -1)).tolist()
            sums = [" + ".join(f"{a!r} * {b}" for a, b in zip(own, waves, strict=True)) for own in sizes]
            code = [_faded(each.format(q=q), q, effect) for each, q in zip(sums, at, strict=True)]
        case "local-joint-error":
            x, y = list(effect.knots), list(c)
            if effect.periodic:
                x, y = [*x, x[0] + 2.0 * np.pi], [*y, y[0]]
            cubics = CubicSpline(x, y, bc_type="periodic" if effect.periodic else "clamped").c.tolist()
            code = [_faded(f"_spline({at[0]}, {x}, {cubics}, {effect.periodic})", at[0], effect)]
        case "thermal-growth":
            warmer = Motion(np.zeros((1, chain.dof)), temperature=np.array([effect.reference + 1.0]))
            grown, drivers = effect.increments(chain, warmer)[0].tolist(), chain.drivers[elements].tolist()
            travel = [f" + {c[0]!r} * q[:, {j}]" if j >= 0 else "" for j in drivers]
            warm = f"(temperature - {effect.reference!r})"
            code = [f"{warm} * ({own!r}{more})" for own, more in zip(grown, travel, strict=True)]
        case "gravity-sag":
            levers = zip(c, effect.terms.split(), strict=True)
            code = [" + ".join(f"{size!r} * {_sag(effect, term, chain)}" for size, term in levers)]
        case _:
            raise OptionError(
                f"a program can't hold the effect '{effect.name}'; use `workbench compensate`",
                option="--for",
                found=effect.name,
            )
    return list(zip(elements, code, strict=True))


def _faded(code: str, q: str, effect: Any) -> str:
    """A map of one joint, which fades out beyond where it was learned."""
    if (known := effect.learned) is None:
        return code
    return f"_fading({q}, {known.low!r}, {known.high!r}, {FADING_KNOTS * known.spacing!r}) * ({code})"


def _flexed(k: int, by_load: list[tuple[float, str]], joint: int, chain: Chain) -> str:
    """One of two components across a joint, in axes that turn with it."""
    size, own = by_load[k]
    other, sign = by_load[k ^ 1][1], "-" if k % 2 else "+"
    angle = f"q[:, {joint}] + {float(chain.values[chain.driven[joint]])!r}" if turns(chain, joint) else "0.0"
    return f"{-size!r} * (np.cos({angle}) * {own} {sign} np.sin({angle}) * {other})"


def _sag(effect: Any, term: str, chain: Chain) -> str:
    """(down × axis) · lever of a weight after the joint; what slides has a lever of its travel."""
    own = int(chain.driven[effect.joints[0]])
    down = (np.array(effect.gravity) / np.linalg.norm(effect.gravity)).tolist()
    if term == PAYLOAD:
        lever = f"payload[:, None] * (frames[-1][:, :3, 3] - frames[{own + 1}][:, :3, 3])"
    else:
        link, axis = int(term[:-1]) - 1, term[-1]
        at = int(chain.driven[link])
        column = chain.axes[at] % 3 if axis == "m" else "xyz".index(axis)
        lever = f"frames[{at + 1}][:, :3, {column}]" + f" * q[:, [{link}]]" * (axis == "m")
    return f"(np.cross({down}, frames[{own + 1}][:, :3, {chain.axes[own] % 3}]) * {lever}).sum(1)"

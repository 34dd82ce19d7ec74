"""The Python file that corrects joints: `standalone.py`, with the arm and its effects filled in."""

from collections.abc import Iterable
from importlib.resources import files
from typing import final

from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.robot import Robot
from workbench.arm.statics.wrenches import masses, mounts
from workbench.base.errors import OptionError
from workbench.exports.export_format import AbstractForm, Job
from workbench.extras.controllers.program.effects_as_code import code_of
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
            "chain": _chain(robot),
            "nominal": _chain(arms.nominal),
            "driven": robot.chain.driven.tolist(),
            "mounts": mounts(robot).tolist(),
            "gravity": robot.gravity.tolist(),
            "masses": weights,
            "needs": [n for n in ("temperature", "direction") if any(n in each for each in code[False])],
        }
        entries = [f"{key!r}: {value!r}".replace("inf", 'float("inf")') for key, value in arm.items()]
        text = files(__package__).joinpath("standalone.py").read_text(encoding="utf-8")
        for place, lines in (("{}  # arm", entries), ("[]  # rest", code[False]), ("[]  # load", code[True])):
            text = text.replace(
                place, "\n".join([place[0], *(f"    {each}," for each in lines), place[1]]), 1
            )
        return text

    def read(self, text: str, job: Job) -> Robot | None:
        return None

    def notes(self, job: Job) -> Iterable[str]:
        yield from comparable(job.robot, job.require_nominal(self.name)).notes
        yield "poses are in the robot's base, with the calibrated tool; loads are those of the arm at rest"


def _chain(robot: Robot) -> list[tuple]:
    """Axis, driving joint, value and constant matrix of each element; no joint drives several of them."""
    compile_arm(robot)
    rows = zip(robot.chain.elements, robot.chain.drivers.tolist(), robot.chain.values.tolist(), strict=True)
    return [(int(e.axis), j, v, None if e.matrix is None else e.matrix.tolist()) for e, j, v in rows]

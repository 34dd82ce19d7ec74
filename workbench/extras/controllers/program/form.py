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
        loaded = [effect for effect in robot.effects if effect.loads]
        if loaded and not robot.has_masses:
            raise OptionError(
                f"--for {self.name}: effects of '{robot.name}' need the moments of its joints, but not all "
                "masses are known; add 'mass' and 'com' to each [[joint]]",
                option="--for",
                found=self.name,
            )
        weights = masses(robot) if loaded else None
        still = [line for e in robot.effects if e not in loaded for line in code_of(e, robot.chain)]
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
            "masses": []
            if weights is None
            else list(zip(weights.after.tolist(), weights.mass.tolist(), weights.com.tolist(), strict=True)),
            "warm": any("temperature" in code for _, code in still),
            "directed": any("direction" in code for _, code in still),
        }
        entries = [f"{key!r}: {value!r}".replace("inf", 'float("inf")') for key, value in arm.items()]
        at_rest, under_load = (
            [f"({element}, {code})" for element, code in lines]
            for lines in (still, [line for e in loaded for line in code_of(e, robot.chain)])
        )
        text = files(__package__).joinpath("standalone.py").read_text(encoding="utf-8")
        for place, lines in (("{}  # arm", entries), ("[]  # at rest", at_rest), ("[]  # load", under_load)):
            opened, closed = place[:2]
            text = text.replace(place, "\n".join([opened, *(f"    {each}," for each in lines), closed]), 1)
        return text

    def read(self, text: str, job: Job) -> Robot | None:
        return None

    def notes(self, job: Job) -> Iterable[str]:
        yield from comparable(job.robot, job.require_nominal(self.name)).notes
        yield "poses are in the robot's base, with the calibrated tool; loads are those of the arm at rest"


def _chain(robot: Robot) -> list[tuple]:
    """Axis, driving joint, value and constant matrix of each element; `compile_arm` refuses other drives."""
    compile_arm(robot)
    chain = robot.chain
    return [
        (int(e.axis), int(driver), float(value), None if e.matrix is None else e.matrix.tolist())
        for e, driver, value in zip(chain.elements, chain.drivers, chain.values, strict=True)
    ]

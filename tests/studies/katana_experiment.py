"""The thesis's experiment with inclinometers (Figs. 4.6, 5.4) on virtual arms: Tables 4.3, 4.4 found again.

Postures that load one joint at a time, with a mass hung onto the tool, are planned, read and fitted; joint 1,
upright, is pulled sideways and seen by the tracker. Hidden sizes are drawn about the printed ones.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from studies.finding import Finding, judged
from studies.katana_study import LOADED
from workbench.arm.built_in_arms import load_robot
from workbench.base.progress import progress, running
from workbench.extras.katana.load_test.experiment import run_load_test

ADDED = 2.0
"""Mass hung onto the tool, so that its own weight is not all that bends a joint [kg]."""
KINDS = ("clearance", "backlash", "stiffness")
WITHIN = (0.05, 0.05, 0.10)
"""Relative errors of the three that are asked of joints 2 to 5."""


class Experiments(NamedTuple):
    """Relative errors of clearance, backlash and stiffness of several arms, joint by joint."""

    errors: Float[np.ndarray, "arms 5 3"]


def experiments(*, arms: int, seed: int = 0) -> Experiments:
    """Relative error of clearance, backlash and stiffness of several virtual arms, joint by joint."""
    robot = load_robot("katana450-three-rotation")
    errors = []
    for arm in range(arms):
        with running():
            found = run_load_test(robot, added_mass=ADDED, seed=seed + arm)
        pairs = zip(found.joints, found.hidden, strict=True)
        errors.append([[getattr(a, kind) / getattr(b, kind) - 1.0 for kind in KINDS] for a, b in pairs])
        progress((arm + 1) / arms, "joints loaded")
    return Experiments(np.array(errors))


def experiment_findings(found: Experiments) -> tuple[Finding, ...]:
    """How nearly the tables' sizes are found again."""
    worst = np.abs(found.errors).max(axis=0)
    findings = []
    for kind, (word, within) in enumerate(zip(KINDS, WITHIN, strict=True)):
        loaded = float(worst[list(LOADED), kind].max())
        table = "Table 4.4" if word == "stiffness" else "Table 4.3"
        findings.append(
            judged(
                table, f"{word} of joints 2 to 5 from inclinometers, greatest error", "(none printed)",
                f"{100 * loaded:.1f} % over {len(found.errors)} arms; joint 1 by side pulls "
                f"{100 * worst[0, kind]:.1f} %", loaded <= within,
                f"0.001° a reading, {ADDED:g} kg at the tool",
            )
        )  # fmt: skip
    return tuple(findings)

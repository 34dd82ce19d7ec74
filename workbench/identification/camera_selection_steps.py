"""Steps of identification from pictures: parameters, benefit, reasons for rejection, advice."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.identification.pixel_noise import Considered
from workbench.identification.problem import Noise

ZEROS, GEOMETRY, EFFECTS = "joint zeros", "geometry", "geometry and effects"
CLEARLY = 2.0
"""A step must move the tool by so many times what it is uncertain, in squares."""
UNEXPLAINED = {ZEROS: 0.5, GEOMETRY: 0.3, EFFECTS: 0.3}
"""Part of the tool's error before, that each step may leave unexplained: what else bends it to fit."""
WORTHWHILE = 0.9
"""Part of the expected error that a step may leave: what else bends zeros lowers it a little too."""
HINTED = 0.5
"""More pictures are advised for a step that moves the tool by this part of what it is uncertain."""
MEANINGLESS = 1e-5
"""Errors of the tool below this [m] are none."""
BENT = "the given camera or target data are wrong, and the geometry would be distorted to compensate"


@dataclass(frozen=True, eq=False)
class Step:
    """One step of the gate.

    Args:
        name: What it frees beside camera and target.
        free: Constants of the arm that it frees.
        pixel: Error of corners in blocks that were not fitted [px, root mean square of a coordinate].
        moved: Distance that it moves the tool [m], from the step before that was taken.
        uncertainty: Of the tool's position from the uncertainty of its constants [m].
        turned: Of the tool's orientation [rad].
        lack: Distance of the tool [m] that the model leaves unexplained in a picture.
        is_lack_shown: Whether it is more than chance.
        weakest: The constant whose uncertainty moves the tool most.
        refused: Why it was not taken; "" where it was.
    """

    name: str
    free: tuple[str, ...]
    pixel: float
    moved: float
    uncertainty: float
    turned: float
    lack: float
    is_lack_shown: bool = True
    weakest: str = ""
    refused: str = ""

    @property
    def expected(self) -> float:
        """Expected error of the tool's position [m]."""
        return float(np.hypot(self.uncertainty, self.lack))


@dataclass(frozen=True, eq=False)
class Gate:
    """What the gate decided.

    Args:
        steps: Every step that was tried.
        taken: Number of the one that holds.
        advice: What to measure next; "" where nothing has to be.
        noise: How corners scatter, and how far the tool is off in every picture.
        doubts: What of camera and target the pictures contradict.
        actual: How corners scatter, where all were weighed alike.
        considered: The arm's constants that stay nominal though they are uncertain.
    """

    steps: tuple[Step, ...]
    taken: int
    advice: str
    noise: Noise
    doubts: tuple[str, ...] = ()
    actual: Noise | None = None
    considered: Considered | None = None

    @property
    def step(self) -> Step:
        """The step that holds."""
        return self.steps[self.taken]

    @property
    def refused(self) -> str:
        """Why the arm stays as it was; "" where something of it was identified."""
        if self.taken:
            return ""
        if self.doubts:
            return self.doubts[0]
        reasons = [f"{step.name}: {step.refused}" for step in self.steps[1:]]
        if not reasons:
            return "it has no constant that these pictures could determine"
        return "; ".join([*reasons, self.advice] if self.advice else reasons)

    @property
    def notes(self) -> list[str]:
        """The decision, one sentence each."""
        step = self.step
        words = [
            f"{step.name}: expected error of the tool {in_mm(step.expected)}, {in_mm(step.uncertainty)} by "
            f"the constants' uncertainty; corners of pictures left out {step.pixel:.2f} px"
        ]
        words += [f"{step.name} not taken: {step.refused}" for step in self.steps if step.refused]
        return [*words, self.advice] if self.advice else words


def judged(step: Step, steps: Sequence[Step]) -> Step:
    """The step, with the reason where it is not taken."""
    before = [s for s in steps if not s.refused][-1]
    reason, bent = "", "zeros" if step.name == ZEROS else "geometry"
    if step.moved**2 <= CLEARLY * step.uncertainty**2:
        known = in_mm(step.uncertainty)
        reason = f"it would move the tool by {in_mm(step.moved)}, which is known to ±{known} only"
    elif step.pixel >= before.pixel:
        reason = (
            f"pictures left out are not predicted better: {step.pixel:.2f} px, {before.pixel:.2f} px before"
        )
    elif step.is_lack_shown and step.lack > max(UNEXPLAINED[step.name] * before.lack, MEANINGLESS):
        reason = (
            f"it leaves {in_mm(step.lack)} of {in_mm(before.lack)} unexplained, so that camera, target, clock"
            f" or an effect of the arm may be to blame, and the {bent} would bend to fit them"
        )
    elif step.expected >= WORTHWHILE * before.expected:
        reason = (
            f"the expected error of the tool stays {in_mm(step.expected)}, {in_mm(before.expected)} before"
        )
    return replace(step, refused=reason)


def advised(steps: Sequence[Step], taken: int, data: Dataset) -> str:
    """What to measure so that the next step could be taken."""
    step = next((s for s in steps[taken + 1 :] if s.moved**2 <= CLEARLY * s.uncertainty**2), None)
    if step is None and (last := steps[-1]).name == EFFECTS and last.refused:
        return (
            "to see whether an effect of the arm is to blame, measure about "
            f"{max(len(data), 30)} more pictures, with the arm folded and stretched out and every joint "
            "turned over its whole range"
        )
    if step is None or (taken and step.moved < HINTED * step.uncertainty):
        return ""
    more = len(data) * (CLEARLY * step.uncertainty**2 / max(step.moved, 1e-9) ** 2 - 1.0)
    count = int(np.clip(np.ceil(more), 5, 300))
    digits = "".join(c for c in step.weakest.split(".")[0] if c.isdigit())
    joint = min(int(digits or 1), data.joints) - 1
    turned = np.rad2deg(np.ptp(data.q[:, joint]))
    return (
        f"to tell more, measure about {count} more pictures, with joint {joint + 1} turned beyond the "
        f"{turned:.0f}° so far and the target near the camera, tilted and in all parts of the picture"
    )

"""Steps of identification from pictures: parameters, benefit, reasons for rejection, advice."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.extras.camera.report import found_json, found_sentences
from workbench.identification.considered import Considered
from workbench.identification.fit import Fit
from workbench.identification.own_preparation import AbstractIdentifiability
from workbench.identification.problem import Noise
from workbench.report.json import Json

ZEROS, GEOMETRY, EFFECTS = "joint zeros", "geometry", "geometry and effects"
NEARBY = 0.15
"""Distance from the measured places [m] within which the error is expected."""
CLEARLY = 2.0
"""A step that moves the tool by less, times what it is uncertain, in squares, needs more pictures."""
NEEDED = {ZEROS: 1.0, GEOMETRY: 2.0, EFFECTS: 0.0}
"""Evidence for a step (twice the gain in log likelihood) that each picture must add on average …"""
MIN_EVIDENCE = 12.0
"""… and all of them together."""
WORTHWHILE = 0.9
"""Part of the expected error that effects may leave."""
HINTED = 0.5
"""More pictures are advised for a step that moves the tool by this part of what it is uncertain."""
WOULD_DISTORT = (
    "the given target's size is wrong, or the lens, and the geometry would be distorted to compensate"
)


@dataclass(frozen=True, eq=False)
class Step:
    """One step of the decision.

    Args:
        name: What it frees beside camera and target.
        free: Constants of the arm that it frees.
        pixel: Error of corners in blocks that were not fitted [px, root mean square distance].
        moved: Distance that it moves the tool [m], from the step before that was taken.
        uncertainty: Of the tool's position from the uncertainty of its constants [m].
        turned: Of the tool's orientation [rad].
        lack: Distance of the tool [m] that the model leaves unexplained in a picture.
        lack_seen: The same with the tool's orientation, at the lever at which cameras see it.
        uncertainty_seen: Likewise the tool's uncertainty.
        evidence: Twice the gain in log likelihood by its constants.
        weakest: The constant whose uncertainty moves the tool most.
        expected: Error of the tool's position [m] within `NEARBY` in any orientation, with what
            stays as given and what no constant explains.
        refused: Why it was not taken; "" where it was.
    """

    name: str
    free: tuple[str, ...]
    pixel: float
    moved: float
    uncertainty: float
    turned: float
    lack: float
    lack_seen: float
    uncertainty_seen: float
    evidence: float = 0.0
    weakest: str = ""
    expected: float = np.nan
    refused: str = ""

    @property
    def expected_seen(self) -> float:
        """What it leaves with the tool's orientation, by which effects are judged [m]."""
        return float(np.hypot(self.uncertainty_seen, self.lack_seen))

    def json(self) -> Json:
        """As plain data."""
        return {
            "name": self.name,
            "taken": not self.refused,
            "reason": self.refused,
            "free": list(self.free),
            "left_out_px": self.pixel,
            "evidence": self.evidence,
            "moved_mm": 1e3 * self.moved,
            "uncertainty_mm": 1e3 * self.uncertainty,
            "uncertainty_deg": np.rad2deg(self.turned),
            "unexplained_mm": 1e3 * self.lack,
            "expected_mm": 1e3 * self.expected,
        }


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Identifiability(AbstractIdentifiability):
    """What was decided.

    Args:
        steps: Every step that was tried.
        taken: Number of the one that holds.
        noise: How corners scatter, and how far the tool is off in every picture.
    """

    steps: tuple[Step, ...]
    taken: int
    noise: Noise

    @property
    def step(self) -> Step:
        return self.steps[self.taken]

    @classmethod
    def of(
        cls,
        steps: Sequence[Step],
        taken: int,
        advice: str,
        noise: Noise,
        doubts: tuple[str, ...],
        actual: Noise | None,
        considered: Considered | None,
    ) -> "Identifiability":
        step = steps[taken]
        return cls(
            title=step.name,
            refused="" if taken else _refused(steps, advice, doubts),
            advice=advice,
            uncertainty=(step.uncertainty, step.turned),
            notes=(*_decisions(steps, step, advice), f"noise from the pictures: {_noise_text(noise)}"),
            doubts=doubts,
            actual=actual,
            considered=considered,
            steps=tuple(steps),
            taken=taken,
            noise=noise,
        )

    def found(self, fit: Fit) -> Iterator[str]:
        return found_sentences(fit)

    def json(self, fit: Fit) -> Json:
        noise = self.noise
        return {
            "camera": {
                "step": self.title,
                "identified": bool(self.taken),
                "refused": self.refused,
                "measure_next": self.advice,
                "steps": [step.json() for step in self.steps],
                "noise": {"pixel_px": np.sqrt(2.0) * noise.own, **noise.json()},
                **found_json(fit),
            }
        }


def _refused(steps: Sequence[Step], advice: str, doubts: tuple[str, ...]) -> str:
    """Why nothing of the arm is taken."""
    if doubts:
        return doubts[0]
    reasons = [f"{step.name}: {step.refused}" for step in steps[1:]]
    if not reasons:
        return "it has no constant that these pictures could determine"
    return "; ".join([*reasons, advice] if advice else reasons)


def _decisions(steps: Sequence[Step], step: Step, advice: str) -> Iterator[str]:
    yield (
        f"{step.name}: expected error of the tool within {100 * NEARBY:g} cm of the measured places, in any "
        f"orientation, {in_mm(step.expected)}; left-out pictures {step.pixel:.2f} px"
    )
    yield from (f"{step.name} not taken: {step.refused}" for step in steps if step.refused)
    if advice:
        yield advice


def _noise_text(noise: Noise) -> str:
    lack = f"{1e3 * noise.position:.3f} mm, {np.rad2deg(noise.rotation):.3f}°"
    pixel = np.sqrt(2.0) * noise.own
    return f"corners {pixel:.2f} px; what the model lacks of the tool's pose {lack} about each axis"


def judged(step: Step, steps: Sequence[Step], pictures: int) -> Step:
    """The step, with the reason where it is not taken."""
    before = [s for s in steps if not s.refused][-1]
    needed = max(NEEDED[step.name] * pictures, MIN_EVIDENCE)
    reason = ""
    if step.name != EFFECTS and step.evidence < needed:
        reason = (
            f"weak evidence in the pictures: twice the log likelihood rises by {step.evidence:.1f}, "
            f"{needed:.0f} are needed; it would move the tool by {in_mm(step.moved)}, known to "
            f"±{in_mm(step.uncertainty)}"
        )
    elif step.pixel >= before.pixel:
        reason = (
            f"left-out pictures are not predicted better: {step.pixel:.2f} px, {before.pixel:.2f} px before"
        )
    elif step.name == EFFECTS and step.expected_seen >= WORTHWHILE * before.expected_seen:
        reason = (
            f"the expected error of the tool stays {in_mm(step.expected_seen)}, "
            f"{in_mm(before.expected_seen)} before"
        )
    return replace(step, refused=reason)


def advised(steps: Sequence[Step], taken: int, data: Dataset) -> str:
    """What to measure so that the next step could be taken."""
    step = next((s for s in steps[taken + 1 :] if s.moved**2 <= CLEARLY * s.uncertainty**2), None)
    if step is None and (last := steps[-1]).name == EFFECTS and last.refused:
        return (
            "to see whether an effect of the arm causes this, take about "
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
        f"to decide, take about {count} more pictures, with joint {joint + 1} turned beyond the "
        f"{turned:.0f}° so far and the target near the camera, tilted and in all parts of the picture"
    )

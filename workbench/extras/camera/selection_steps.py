"""Steps of identification from pictures: benefit, reasons for rejection, advice, and what the last gives."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, final

import numpy as np

from workbench.base import se3
from workbench.base.types import Freedom
from workbench.base.wording import in_mm, plural
from workbench.data.dataset import Dataset
from workbench.extras.camera.camera import INTRINSICS
from workbench.extras.camera.observation import POSE, Placed
from workbench.extras.camera.rig import owner_in, rig_of
from workbench.identification.fit import Fit
from workbench.identification.instrument_preparation import AbstractIdentifiability
from workbench.identification.problem import Noise
from workbench.report.json import Json
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields

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
MOVED_FROM, MIN_MOVED = 3.0, np.deg2rad(0.03)
"""Standard errors, and an angle [rad], beyond which a joint's zero is said to have moved."""
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


STEP = ResultFields(
    "name",
    ResultField("taken", of=lambda step: not step.refused),
    ResultField("reason", of="refused"),
    "free",
    ResultField("left_out_px", of="pixel"),
    "evidence",
    ResultField("moved", MM),
    ResultField("uncertainty", MM),
    ResultField("uncertainty", DEG, of="turned"),
    ResultField("unexplained", MM, of="lack"),
    ResultField("expected", MM),
)
"""Of a `Step`."""


class Zero(NamedTuple):
    """A joint's zero: its change from nominal and the standard error of it [rad or m]."""

    joint: str
    unit: str
    change: float
    std: float

    @property
    def moved(self) -> bool:
        """Whether it has moved beyond doubt."""
        return abs(self.change) > max(MOVED_FROM * self.std, MIN_MOVED)

    @property
    def text(self) -> str:
        """The change with its standard error."""
        scale, unit = (np.rad2deg(1.0), "°") if self.unit == "rad" else (1e3, " mm")
        return (
            f"{self.joint}: its zero is off by {scale * self.change:+.3f}{unit} ± "
            f"{scale * self.std:.3f}{unit} (one standard error)"
        )


def zeros(fit: Fit) -> tuple[Zero, ...]:
    """Zeros that were identified, in the order of the joints."""
    offsets = set(fit.problem.robot.joint_offsets)
    rows = zip(fit.parameters, fit.x.tolist(), fit.std.tolist(), strict=True)
    return tuple(
        Zero(p.name.split(".")[0], p.unit, value - p.nominal, std)
        for p, value, std in rows
        if p.name in offsets
    )


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
        noise: Noise,
        *,
        advice: str,
        doubts: tuple[str, ...],
        **more: Any,
    ) -> "Identifiability":
        step = steps[taken]
        return cls(
            title=step.name,
            refused="" if taken else _refused(steps, advice, doubts),
            advice=advice,
            uncertainty=(step.uncertainty, step.turned),
            notes=(*_decisions(steps, step, advice), f"noise from the pictures: {_noise_text(noise)}"),
            doubts=doubts,
            steps=tuple(steps),
            taken=taken,
            noise=noise,
            **more,
        )

    def found(self, fit: Fit) -> Iterator[str]:
        """Zeros that moved, then where each camera and the target are, lenses and points."""
        yield from (zero.text for zero in zeros(fit) if zero.moved)
        for name, pose in _poses(fit).items():
            xyz = ", ".join(f"{1e3 * v:.2f}" for v in pose["xyz"])
            rpy = ", ".join(f"{v:.3f}" for v in pose["rpy_deg"])
            yield (
                f"{name} on the {pose['mounted']}: xyz {xyz} mm ± {max(pose['xyz_std_mm']):.2g}, "
                f"rpy {rpy}° ± {max(pose['rotation_std_deg']):.2g} (one standard error)"
            )
        for camera in rig_of(fit.problem.data).cameras:
            if camera.free is not Freedom.FIXED:
                at = [fit.problem.names.index(f"{camera.owner}.{part}") for part in INTRINSICS[:6]]
                rows = zip(INTRINSICS, fit.x[at], fit.std[at], (".1f",) * 4 + (".4f",) * 2, strict=False)
                lens = ", ".join(f"{part} {value:{form}} ± {std:.2g}" for part, value, std, form in rows)
                yield f"{camera.owner} lens: {lens} (px; one standard error)"
        if points := _points(fit):
            worst = max(max(point["xyz_std_mm"]) for point in points)
            yield f"{plural(len(points), 'point')} of the target placed to ±{worst:.2g} mm or better"

    def json(self, fit: Fit) -> Json:
        noise = self.noise
        return {
            "camera": {
                "step": self.title,
                "identified": bool(self.taken),
                "refused": self.refused,
                "measure_next": self.advice,
                "steps": STEP.each(self.steps),
                "noise": {"pixel_px": np.sqrt(2.0) * noise.own, **noise.json()},
                "poses": _poses(fit),
                "zeros": [{**zero._asdict(), "moved": zero.moved} for zero in zeros(fit)],
                "points": _points(fit),
                "set_apart": [vars(corner) for corner in rig_of(fit.problem.data).rejected],
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


def _points(fit: Fit) -> list[dict[str, Any]]:
    """Places of points that were not known, in their target's frame, with standard errors."""
    found = []
    for target in rig_of(fit.problem.data).targets:
        for name, k in target.own_places.items():
            at = [fit.problem.names.index(f"{name}.{axis}") for axis in POSE[:3]]
            std = np.sqrt(np.maximum(np.diag(fit.covariance)[at], 0.0))
            own = {"id": int(target.ids[k]), "corner": int(target.corners[k])}
            found.append({"target": target.name, **own, "xyz": fit.x[at], "xyz_std_mm": 1e3 * std})
    return found


def _poses(fit: Fit) -> Json:
    """Pose of every camera and of the target in what carries it, standard errors about that one's axes."""
    rig, names = rig_of(fit.problem.data), fit.problem.names
    values = fit.problem.named(fit.x)
    found: Json = {}
    sessions = fit.problem.data.sessions
    owners = {owner_in(part, s): (part, s) for part in rig.posed for s in sessions}
    for name, (part, session) in owners.items():
        if f"{name}.x" not in values:
            continue
        places = [names.index(f"{name}.{axis}") for axis in POSE]
        placed = Placed.at(fit.x[places])
        covariance = fit.covariance[np.ix_(places, places)]
        turn = placed.turning @ covariance[3:, 3:] @ placed.turning.T
        found[name] = {
            "mounted": str(part.mounted),
            **({"session": session} if name != part.owner else {}),
            "xyz": placed.pose[:3, 3],
            "rpy_deg": np.rad2deg(se3.matrix_to_rpy(placed.pose[:3, :3])),
            "quat_wxyz": se3.matrix_to_quaternion(placed.pose[:3, :3]),
            "xyz_std_mm": 1e3 * np.sqrt(np.diag(covariance)[:3]),
            "rotation_std_deg": np.rad2deg(np.sqrt(np.maximum(np.diag(turn), 0.0))),
        }
        if f"{part.owner}.fx" in values:
            lens = [names.index(f"{part.owner}.{k}") for k in INTRINSICS]
            found[name]["intrinsics"] = dict(zip(INTRINSICS, fit.x[lens].tolist(), strict=True))
            found[name]["intrinsics_std"] = dict(zip(INTRINSICS, fit.std[lens].tolist(), strict=True))
    return found

"""What pictures identified, for people and for files: the steps of the decision, zeros, poses, lenses."""

from collections.abc import Iterator
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, final

import numpy as np

from workbench.base import se3
from workbench.base.types import Freedom
from workbench.base.wording import plural
from workbench.extras.camera.camera import INTRINSICS
from workbench.extras.camera.observation import POSE, Placed
from workbench.extras.camera.rig import owner_in, rig_of
from workbench.identification.fit import Fit
from workbench.identification.instrument_preparation import AbstractIdentifiability
from workbench.identification.problem import Noise
from workbench.report.json import Json
from workbench.report.result_fields import ResultField, ResultFields

TAKE_MORE = "to decide, take more pictures, with the joints turned further and the target near and tilted"
MOVED_FROM, MIN_MOVED = 3.0, np.deg2rad(0.03)
"""Standard errors, and an angle [rad], beyond which a joint's zero is said to have moved."""


@dataclass(frozen=True, eq=False)
class Step:
    """One step of the decision.

    Args:
        name: What it frees beside camera and target.
        free: Constants of the arm that it frees.
        pixel: Error of corners [px, root mean square distance].
        evidence: Twice the gain in log likelihood by its constants.
        refused: Why it was not taken; "" where it was.
    """

    name: str
    free: tuple[str, ...]
    pixel: float
    evidence: float
    refused: str


STEP = ResultFields(
    "name",
    ResultField("taken", of=lambda step: not step.refused),
    ResultField("reason", of="refused"),
    "free",
    ResultField("fitted_px", of="pixel"),
    "evidence",
)
"""Of a `Step`."""


def zeros(fit: Fit) -> list[dict[str, Any]]:
    """Zeros that were identified, in the order of the joints: change and standard error [rad or m]."""
    offsets, found = set(fit.problem.robot.joint_offsets), []
    for p, value, std in zip(fit.parameters, fit.x.tolist(), fit.std.tolist(), strict=True):
        if p.name in offsets:
            change = value - p.nominal
            zero = {"joint": p.name.split(".")[0], "unit": p.unit, "change": change, "std": std}
            found.append({**zero, "moved": abs(change) > max(MOVED_FROM * std, MIN_MOVED)})
    return found


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
        cls, steps: tuple[Step, ...], taken: int, noise: Noise, *, doubts: tuple[str, ...], **more: Any
    ) -> "Identifiability":
        step, lack = steps[taken], f"{1e3 * noise.position:.3f} mm, {np.rad2deg(noise.rotation):.3f}°"
        reasons = list(doubts[:1]) or [f"{each.name}: {each.refused}" for each in steps[1:]]
        advice = "" if doubts or not any(each.refused for each in steps) else TAKE_MORE
        reasons += [advice] if advice else []
        unknown = "it has no constant that these pictures could determine"
        notes = [
            *(f"{each.name} not taken: {each.refused}" for each in steps if each.refused),
            *([advice] if advice else []),
            f"noise from the pictures: corners {np.sqrt(2.0) * noise.own:.2f} px; what the model lacks of "
            f"the tool's pose {lack} about each axis",
        ]
        return cls(
            title=step.name,
            refused="" if taken else "; ".join(reasons) or unknown,
            advice=advice,
            notes=tuple(notes),
            doubts=doubts,
            steps=steps,
            taken=taken,
            noise=noise,
            **more,
        )

    def found(self, fit: Fit) -> Iterator[str]:
        """Zeros that moved, then where each camera and the target are, lenses and points."""
        for zero in filter(itemgetter("moved"), zeros(fit)):
            scale, unit = (np.rad2deg(1.0), "°") if zero["unit"] == "rad" else (1e3, " mm")
            change, std = scale * zero["change"], scale * zero["std"]
            text = f"its zero is off by {change:+.3f}{unit} ± {std:.3f}{unit} (one standard error)"
            yield f"{zero['joint']}: {text}"
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
        return {
            "camera": {
                "step": self.title,
                "identified": bool(self.taken),
                "refused": self.refused,
                "measure_next": self.advice,
                "steps": STEP.each(self.steps),
                "noise": {"pixel_px": np.sqrt(2.0) * self.noise.own, **self.noise.json()},
                "poses": _poses(fit),
                "zeros": zeros(fit),
                "points": _points(fit),
                "set_apart": [vars(corner) for corner in rig_of(fit.problem.data).rejected],
            }
        }


def _points(fit: Fit) -> list[dict[str, Any]]:
    """Places of points that were not known, in their target's frame, with standard errors."""
    found = []
    for target in rig_of(fit.problem.data).targets:
        for name, k in target.own_places.items():
            at = [k for k, of in enumerate(fit.problem.names) if of.startswith(f"{name}.")]
            own = {"id": int(target.ids[k]), "corner": int(target.corners[k])}
            found.append({"target": target.name, **own, "xyz": fit.x[at], "xyz_std_mm": 1e3 * fit.std[at]})
    return found


def _poses(fit: Fit) -> Json:
    """Pose of every camera and of the target in what carries it, standard errors about that one's axes."""
    rig, names = rig_of(fit.problem.data), fit.problem.names
    values, std = fit.problem.named(fit.x), dict(zip(names, fit.std.tolist(), strict=True))
    found: Json = {}
    sessions = fit.problem.data.sessions
    owners = {owner_in(part, s): (part, s) for part in rig.posed for s in sessions}
    for name, (part, session) in owners.items():
        if f"{name}.x" not in values:
            continue
        places = [names.index(f"{name}.{axis}") for axis in POSE]
        placed = Placed.at(fit.x[places])
        turn = placed.turning @ fit.covariance[np.ix_(places[3:], places[3:])] @ placed.turning.T
        found[name] = {
            "mounted": str(part.mounted),
            **({"session": session} if name != part.owner else {}),
            "xyz": placed.pose[:3, 3],
            "rpy_deg": np.rad2deg(se3.matrix_to_rpy(placed.pose[:3, :3])),
            "quat_wxyz": se3.matrix_to_quaternion(placed.pose[:3, :3]),
            "xyz_std_mm": 1e3 * fit.std[places[:3]],
            "rotation_std_deg": np.rad2deg(np.sqrt(np.maximum(np.diag(turn), 0.0))),
        }
        if f"{part.owner}.fx" in values:
            found[name]["intrinsics"] = {k: values[f"{part.owner}.{k}"] for k in INTRINSICS}
            found[name]["intrinsics_std"] = {k: std[f"{part.owner}.{k}"] for k in INTRINSICS}
    return found

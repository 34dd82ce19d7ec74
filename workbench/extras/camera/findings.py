"""What pictures identified, for people and for files: the steps of the decision, and poses."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from workbench.base import se3
from workbench.extras.camera.observation import POSE, Placed
from workbench.extras.camera.rig import owner_in, rig_of
from workbench.identification.fit import Fit
from workbench.identification.instrument_preparation import AbstractIdentifiability
from workbench.identification.problem import Noise
from workbench.report.json import Json

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
            yield (
                f"{name} on the {pose['mounted']}: xyz {xyz} mm ± {max(pose['xyz_std_mm']):.2g}, "
                f"rpy {rpy}° ± {max(pose['rotation_std_deg']):.2g} (one standard error)"
            )

    def json(self, fit: Fit) -> Json:
        apart = [vars(corner) for corner in rig_of(fit.problem.data).rejected]
        return {"camera": self.decided | {"poses": _poses(fit), "set_apart": apart}}


def identifiability(
    steps: Sequence[Json], noise: Noise, *, doubts: tuple[str, ...], **more: Any
) -> Identifiability:
    """What the steps that were tried decide, of which the last one taken holds, and how corners and tool
    scatter."""
    title = [step["name"] for step in steps if step["taken"]][-1]
    lack = f"{1e3 * noise.position:.3f} mm, {np.rad2deg(noise.rotation):.3f}°"
    lost = {step["name"]: step["reason"] for step in steps if step["reason"]}
    taken = title != steps[0]["name"]
    reasons = doubts[:1] or [f"{step['name']}: {step['reason']}" for step in steps[1:]]
    advice = [] if doubts or not lost else [TAKE_MORE]
    unknown = "it has no constant that these pictures could determine"
    refused = "" if taken else "; ".join([*reasons, *advice]) or unknown
    decided = {
        "step": title,
        "identified": taken,
        "refused": refused,
        "measure_next": "".join(advice),
        "steps": steps,
        "noise": {"pixel_px": np.sqrt(2.0) * noise.own, **noise.json()},
    }
    return Identifiability(
        title=title,
        refused=refused,
        advice="".join(advice),
        notes=(
            *(f"{name} not taken: {reason}" for name, reason in lost.items()),
            *advice,
            f"noise from the pictures: corners {np.sqrt(2.0) * noise.own:.2f} px; what the model lacks of "
            f"the tool's pose {lack} about each axis",
        ),
        doubts=doubts,
        decided=decided,
        **more,
    )


def _poses(fit: Fit) -> Json:
    """Pose of every camera and of the target in what carries it, standard errors about that one's axes."""
    rig, names = rig_of(fit.problem.data), fit.problem.names
    found: Json = {}
    owners = {owner_in(part, s): (part, s) for part in rig.posed for s in fit.problem.data.sessions}
    for name, (part, session) in owners.items():
        if f"{name}.x" not in names:
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
    return found

"""Results from pictures: poses of camera and target, joint zeros that moved, decisions of the steps."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from workbench.base import se3
from workbench.data.camera.camera import INTRINSICS
from workbench.data.observations.pixels import POSE, Placed
from workbench.identification.fit import Fit
from workbench.identification.result import Identification
from workbench.report.json import Json

SURE, LEAST_MOVED = 3.0, np.deg2rad(0.03)
"""Standard errors, and an angle [rad], beyond which a joint's zero is said to have moved."""
NORMAL = 1.96
"""Standard errors of a 95 % interval."""


class Zero(NamedTuple):
    """A joint's zero: its change from nominal and the standard error of it [rad or m]."""

    joint: str
    unit: str
    change: float
    std: float

    @property
    def moved(self) -> bool:
        """Whether it has moved beyond doubt."""
        return abs(self.change) > max(SURE * self.std, LEAST_MOVED)

    @property
    def words(self) -> str:
        """The change with its 95 % interval."""
        scale, unit = (np.rad2deg(1.0), "°") if self.unit == "rad" else (1e3, " mm")
        return (
            f"{self.joint}: its zero is off by {scale * self.change:+.3f}{unit} ± "
            f"{scale * NORMAL * self.std:.3f}{unit} (95 %)"
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


def camera_words(result: Identification) -> Iterator[str]:
    """Sentences for people: zeros that moved, then where each camera and the target are."""
    if result.gate is None:
        return
    fit = result.best.fit
    yield from (zero.words for zero in zeros(fit) if zero.moved)
    for name, pose in _poses(fit).items():
        xyz = ", ".join(f"{1e3 * v:.2f}" for v in pose["xyz"])
        rpy = ", ".join(f"{v:.3f}" for v in pose["rpy_deg"])
        yield (
            f"{name} on the {pose['mounted']}: xyz {xyz} mm ± {max(pose['xyz_std_mm']):.2g}, "
            f"rpy {rpy}° ± {max(pose['rotation_std_deg']):.2g} (one standard error)"
        )


def camera_json(result: Identification) -> Json:
    """The same as plain data; nothing for other instruments."""
    gate, rig = result.gate, result.data.rig
    if gate is None or rig is None:
        return {}
    fit = result.best.fit
    steps = [
        {
            "name": step.name,
            "taken": not step.refused,
            "reason": step.refused,
            "free": list(step.free),
            "left_out_px": step.pixel,
            "moved_mm": 1e3 * step.moved,
            "uncertainty_mm": 1e3 * step.uncertainty,
            "uncertainty_deg": np.rad2deg(step.turned),
            "unexplained_mm": 1e3 * step.lack,
            "expected_mm": 1e3 * step.expected,
        }
        for step in gate.steps
    ]
    noise = gate.noise
    return {
        "camera": {
            "step": gate.step.name,
            "identified": bool(gate.taken),
            "refused": gate.refused,
            "measure_next": gate.advice,
            "steps": steps,
            "noise": {"pixel_px": noise.pixel, **noise.json()},
            "poses": _poses(fit),
            "zeros": [
                {"joint": z.joint, "unit": z.unit, "change": z.change, "std": z.std, "moved": z.moved}
                for z in zeros(fit)
            ],
            "set_apart": [vars(corner) for corner in rig.apart],
        }
    }


def _poses(fit: Fit) -> Json:
    """Pose of every camera and of the target in what carries it, standard errors about that one's axes."""
    rig, names = fit.problem.data.rig, fit.problem.names
    assert rig is not None, "pictures were fitted"
    values = fit.problem.named(fit.x)
    found: Json = {}
    carriers = {f"camera[{c.name}]": c.mounted for c in rig.cameras} | {
        target.owner: rig.mounted for target in rig.targets
    }
    for name, mounted in carriers.items():
        places = [names.index(f"{name}.{part}") for part in POSE]
        placed = Placed.at(fit.x[places])
        covariance = fit.covariance[np.ix_(places, places)]
        turn = placed.turning @ covariance[3:, 3:] @ placed.turning.T
        found[name] = {
            "mounted": str(mounted),
            "xyz": placed.pose[:3, 3],
            "rpy_deg": np.rad2deg(se3.matrix_to_rpy(placed.pose[:3, :3])),
            "quat_wxyz": se3.matrix_to_quaternion(placed.pose[:3, :3]),
            "xyz_std_mm": 1e3 * np.sqrt(np.diag(covariance)[:3]),
            "rotation_std_deg": np.rad2deg(np.sqrt(np.maximum(np.diag(turn), 0.0))),
        }
        if f"{name}.fx" in values:
            found[name]["intrinsics"] = {k: values[f"{name}.{k}"] for k in INTRINSICS}
    return found

"""Results from pictures: poses of camera and target, joint zeros that moved."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from workbench.base import se3
from workbench.base.types import Freedom
from workbench.base.wording import plural
from workbench.extras.camera.camera import INTRINSICS, Camera
from workbench.extras.camera.observation import POSE, Placed
from workbench.extras.camera.rig import owner_in, rig_of
from workbench.identification.fit import Fit
from workbench.report.json import Json

MOVED_FROM, MIN_MOVED = 3.0, np.deg2rad(0.03)
"""Standard errors, and an angle [rad], beyond which a joint's zero is said to have moved."""


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


def found_sentences(fit: Fit) -> Iterator[str]:
    """Sentences for people: zeros that moved, then where each camera and the target are."""
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
            yield f"{camera.owner} lens: {_lens_text(fit, camera)} (one standard error)"
    if points := _points(fit):
        worst = max(max(point["xyz_std_mm"]) for point in points)
        yield f"{plural(len(points), 'point')} of the target placed to ±{worst:.2g} mm or better"


def _lens_text(fit: Fit, camera: Camera) -> str:
    """The intrinsics that matter, with their standard errors."""
    parts = []
    for part, digits, unit in zip(INTRINSICS[:6], (1, 1, 1, 1, 4, 4), (*[" px"] * 4, "", ""), strict=True):
        at = fit.problem.names.index(f"{camera.owner}.{part}")
        parts.append(f"{part} {fit.x[at]:.{digits}f} ± {fit.std[at]:.2g}{unit}")
    return ", ".join(parts)


def found_json(fit: Fit) -> Json:
    """The same as plain data."""
    return {
        "poses": _poses(fit),
        "zeros": [
            {"joint": z.joint, "unit": z.unit, "change": z.change, "std": z.std, "moved": z.moved}
            for z in zeros(fit)
        ],
        "points": _points(fit),
        "set_apart": [vars(corner) for corner in rig_of(fit.problem.data).rejected],
    }


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

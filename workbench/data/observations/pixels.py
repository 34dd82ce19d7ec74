"""Points of a target in the pictures of cameras, one on the tool and the other in the world.

With T the tool's pose, X that of a camera (in the world, or in the tool), Z that of the target (in the
other), and ξ a point of the target,

    camera in the world      c = X⁻¹ T Z ξ
    camera on the tool       c = X⁻¹ T⁻¹ Z ξ,      residual = measured − project(c)

X and Z are unknown, each a position and a rotation vector, every board with its own Z; the intrinsics where
the camera's file says so; a board's size, ξ = (1 + scale) ξ₀, and three bends of it, b_xx x² + b_xy xy +
b_yy y², where these are not exact. First guesses of X and Z are closed forms from each picture's own pose of
the board.
"""

from collections.abc import Mapping
from functools import cached_property
from itertools import product
from typing import NamedTuple, final

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.hand_eye import hand_eye, mean_base, nearest_rotation
from workbench.base.types import Freedom
from workbench.data.camera.camera import INTRINSICS, Camera, Mount, project
from workbench.data.camera.rig import Rig
from workbench.data.camera.target import Target
from workbench.data.dataset import Dataset
from workbench.data.observations.observation import AbstractObservation, Channel, Seen, Unknown

POSE = ("x", "y", "z", "rx", "ry", "rz")
BENDS = ("bend_xx", "bend_xy", "bend_yy")
OUTLYING = 4.0
"""Pictures whose turn is this many times the median off take no part in the first guess."""


class Placed(NamedTuple):
    """A pose from its six unknowns, and what turns it: Jₗ of the rotation vector."""

    pose: Float[np.ndarray, "4 4"]
    turning: Float[np.ndarray, "3 3"]

    @classmethod
    def at(cls, values: Float[np.ndarray, "6"]) -> "Placed":
        """The pose at x y z [m] and a rotation vector [rad]."""
        turning = np.linalg.inv(se3.left_jacobian_inverse(values[3:]))
        return cls(se3.pose(se3.rotvec_to_matrix(values[3:]), values[:3]), turning)


@final
class PixelObservation(AbstractObservation):
    """Rows of pictures, all cameras of a row at once.

    Args:
        measured: Where each point was [px]; NaN where it was not seen.
        sight: Pose of each board in each camera by that camera alone; NaN where unknown.
        rig: Cameras and boards.
    """

    measured: Float[np.ndarray, "rows cameras points 2"]
    sight: Float[np.ndarray, "rows cameras boards 4 4"]
    rig: Rig
    sees_base = False
    is_tool_free = True

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (Channel.PIXEL,) * int(np.prod(self.measured.shape[1:]))

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        return np.zeros(len(data), bool) if data.pixels is None else np.isfinite(data.pixels).any((1, 2, 3))

    @classmethod
    def of(cls, data: Dataset) -> "PixelObservation":
        assert data.pixels is not None, "data without cameras"
        assert data.sight is not None, "they come together"
        assert data.rig is not None, "they come together"
        return cls(data.pixels, data.sight, data.rig)

    @property
    def seen(self) -> Bool[np.ndarray, "..."]:
        return np.isfinite(self.measured).reshape(len(self.measured), -1)

    @property
    def unknowns(self) -> tuple[str, ...]:
        names = []
        for camera in self.rig.cameras:
            parts = POSE if camera.free is Freedom.FIXED else (*POSE, *INTRINSICS)
            names += [f"camera[{camera.name}].{part}" for part in parts]
        for target in self.rig.targets:
            parts = (*POSE, *(("scale",) if target.scale_sigma else ()))
            parts = (*parts, *(BENDS if target.flatness_sigma else ()))
            names += [f"{target.owner}.{part}" for part in parts]
        return tuple(names)

    @cached_property
    def _place(self) -> dict[str, int]:
        """Number of each unknown."""
        return {name: k for k, name in enumerate(self.unknowns)}

    @property
    def known(self) -> Mapping[str, Unknown]:
        found: dict[str, Unknown] = {}
        for target in self.rig.targets:
            found |= {f"{target.owner}.{part}": Unknown("rad") for part in POSE[3:]}
            found[f"{target.owner}.scale"] = Unknown("1", sigma=target.scale_sigma)
            found |= {f"{target.owner}.{bend}": Unknown("m", sigma=target.flatness_sigma) for bend in BENDS}
        for camera in self.rig.cameras:
            found |= {f"camera[{camera.name}].{part}": Unknown("rad") for part in POSE[3:]}
            guessed = camera.free is Freedom.AUTO
            for k, part in enumerate(INTRINSICS):
                unit, natural = ("px", float(camera.intrinsics[k % 2])) if k < 4 else ("1", 1.0)
                sigma = float(camera.sigma[k]) if guessed else None
                found[f"camera[{camera.name}].{part}"] = Unknown(unit, natural, sigma)
        return found

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        cameras, boards = self._placed(poses)
        found = dict.fromkeys(self.unknowns, 0.0)
        for camera, pose in zip(self.rig.cameras, cameras, strict=True):
            found |= _coordinates(f"camera[{camera.name}]", pose)
            if camera.free is not Freedom.FIXED:
                names = (f"camera[{camera.name}].{part}" for part in INTRINSICS)
                found |= dict(zip(names, camera.intrinsics.tolist(), strict=True))
        for target, pose in zip(self.rig.targets, boards, strict=True):
            found |= _coordinates(target.owner, pose)
        return np.array(list(found.values()))

    def _placed(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Poses of cameras and boards: of the pair with most pictures by a closed form, and on from there."""
        seen = np.isfinite(self.sight[..., 0, 0])
        count = seen.sum(0)
        cameras, boards = (np.tile(np.eye(4), (n, 1, 1)) for n in count.shape)
        stands, held = (np.zeros(n, bool) for n in count.shape)
        while (new := count * ~(stands[:, None] & held)).any():
            half = new * (stands[:, None] | held)
            c, b = np.unravel_index(int((half if half.any() else new).argmax()), new.shape)
            rows = seen[:, c, b]
            sight, camera = self.sight[rows, c, b], self.rig.cameras[c]
            carried = poses[rows] if camera.mounted is Mount.WORLD else se3.inverse(poses[rows])
            if held[b]:
                cameras[c] = _mean(carried @ boards[b] @ se3.inverse(sight))
            elif stands[c]:
                boards[b] = _mean(se3.inverse(carried) @ cameras[c] @ sight)
            else:
                boards[b] = self._target(poses[rows], sight, camera)
            stands[c] |= held[b]
            held[b] = True
        return cameras, boards

    @staticmethod
    def _target(poses: np.ndarray, sight: np.ndarray, camera: Camera) -> Float[np.ndarray, "4 4"]:
        """The target's pose in what carries it, pictures that contradict the others left out."""
        seen = sight if camera.mounted is Mount.WORLD else se3.inverse(sight)
        for _ in range(3):
            z = hand_eye(poses, seen)
            x = mean_base(poses @ z, seen)
            off = np.linalg.norm(se3.pose_error(seen, x @ poses @ z)[:, 3:], axis=1)
            keep = off <= OUTLYING * np.median(off) + 1e-9
            if keep.all() or keep.sum() < 4:
                break
            poses, seen = poses[keep], seen[keep]
        return z if camera.mounted is Mount.WORLD else se3.inverse(x)

    def see(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Seen:
        place = self._place
        residual = np.zeros(self.measured.shape)
        by_twist = np.zeros((*self.measured.shape, 6))
        by_unknown = np.zeros((*self.measured.shape, len(place)))
        for (c, camera), (target, part) in product(enumerate(self.rig.cameras), self.rig.parts):
            mine = np.s_[:, c, part]
            row, spot = np.nonzero(np.isfinite(self.measured[mine]).all(2))
            board, xi = _shaped(target, unknown, place)
            held = se3.apply(board.pose, xi)
            first = place[f"camera[{camera.name}].x"]
            stand = Placed.at(unknown[first : first + 6])
            free = camera.free is not Freedom.FIXED
            intrinsics = unknown[first + 6 : first + 15] if free else camera.intrinsics
            fixed = camera.mounted is Mount.WORLD
            carried = (poses if fixed else se3.inverse(poses))[row]
            q = se3.apply(carried, held[spot])
            from_stand = q - stand.pose[:3, 3]
            at = project(from_stand @ stand.pose[:3, :3], intrinsics)
            residual[mine][row, spot] = self.measured[mine][row, spot] - at.pixel
            by_q = _times(at.by_point, stand.pose[:3, :3].T)
            by_held = by_q @ carried[:, :3, :3]
            place_of, pull = (q, by_q) if fixed else (held[spot], -by_held)
            lever = place_of - poses[row, :3, 3]
            by_twist[mine][row, spot] = np.concatenate([pull, -_turned(pull, lever)], axis=-1)
            out = np.zeros((len(row), 2, len(place)))
            out[..., first : first + 3] = -by_q
            out[..., first + 3 : first + 6] = _times(_turned(by_q, from_stand), stand.turning)
            if free:
                out[..., first + 6 : first + 15] = at.by_intrinsics
            k = place[f"{target.owner}.x"]
            out[..., k : k + 3] = by_held
            turned = _turned(by_held, (held - board.pose[:3, 3])[spot])
            out[..., k + 3 : k + 6] = -_times(turned, board.turning)
            by_xi = _times(by_held, board.pose[:3, :3])
            if (k := place.get(f"{target.owner}.scale", -1)) >= 0:
                out[..., k] = (by_xi * target.points[spot, None]).sum(2)
            if (k := place.get(f"{target.owner}.bend_xx", -1)) >= 0:
                out[..., k : k + 3] = by_xi[..., 2:] * target.bends[spot, None]
            by_unknown[mine][row, spot] = out
        rows, size = len(residual), residual[0].size
        return Seen(
            residual.reshape(rows, size),
            by_twist.reshape(rows, size, 6),
            by_unknown.reshape(rows, size, len(place)),
        )


def _shaped(target: Target, unknown: np.ndarray, place: Mapping[str, int]) -> tuple[Placed, np.ndarray]:
    """A board's pose, and its points with size and bends."""
    spot = place[f"{target.owner}.x"]
    xi = target.points
    if (k := place.get(f"{target.owner}.scale")) is not None:
        xi = xi * (1.0 + unknown[k])
    if (k := place.get(f"{target.owner}.bend_xx")) is not None:
        xi = xi + np.array([0.0, 0.0, 1.0]) * (target.bends @ unknown[k : k + 3])[:, None]
    return Placed.at(unknown[spot : spot + 6]), xi


def _mean(poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "4 4"]:
    """One pose of many that should be the same."""
    return se3.pose(nearest_rotation(poses[:, :3, :3].sum(0)), np.median(poses[:, :3, 3], axis=0))


def _coordinates(owner: str, pose: Float[np.ndarray, "4 4"]) -> dict[str, float]:
    """The six unknowns of a pose, by name."""
    six = np.concatenate([pose[:3, 3], se3.matrix_to_rotvec(pose[:3, :3])])
    return dict(zip((f"{owner}.{part}" for part in POSE), six.tolist(), strict=True))


def _times(rows: Float[np.ndarray, "n 2 3"], matrix: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "n 2 3"]:
    """All rows times one matrix, in one product."""
    return (rows.reshape(-1, 3) @ matrix).reshape(rows.shape)


def _turned(rows: Float[np.ndarray, "n 2 3"], arm: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2 3"]:
    """Rows times [arm]×: b × a."""
    (bx, by, bz), (ax, ay, az) = np.moveaxis(rows, 2, 0), arm.T[:, :, None]
    return np.stack([by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax], axis=2)

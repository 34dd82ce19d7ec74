"""Points of a target in the pictures of cameras, one on the tool and the other in the world.

With T the tool's pose, X that of a camera (in the world, or in the tool), Z that of the target (in the
other), and ξ a point of the target,

    camera in the world      c = X⁻¹ T Z ξ
    camera on the tool       c = X⁻¹ T⁻¹ Z ξ,      residual = measured − project(c)

X and Z are unknown, each a position and a rotation vector, every board with its own Z, and in every session
another X or Z where the files say so; the intrinsics where the camera's file says so; a board's size,
ξ = (1 + scale) ξ₀, and three bends of it, b_xx x² + b_xy xy + b_yy y², where these are not exact. First
guesses of X and Z are closed forms from each picture's own pose of the board.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import chain, product
from typing import NamedTuple, final

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset, Labels
from workbench.data.observation import AbstractObservation, Channel, Linearised, OwnErrors, Unknown
from workbench.extras.camera.camera import INTRINSICS, Camera, Mount, project
from workbench.extras.camera.likelihood import NOISE, Likelihood, Pictures
from workbench.extras.camera.resection import placed
from workbench.extras.camera.rig import PictureReadings, Rig, owner_in
from workbench.extras.camera.target import PictureTarget

POSE = ("x", "y", "z", "rx", "ry", "rz")


class Placement(NamedTuple):
    """Rows in which a camera, or a board, has one pose.

    Args:
        number: Of the camera or board.
        owner: How the names of the pose's unknowns begin.
        rows: Which rows these are.
    """

    number: int
    owner: str
    rows: Bool[np.ndarray, " rows"]


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
        session: Of each row; "" without.
    """

    measured: Float[np.ndarray, "rows cameras points 2"]
    sight: Float[np.ndarray, "rows cameras boards 4 4"]
    rig: Rig
    session: Labels
    sees_base = False
    is_tool_free = True

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (Channel.OWN,) * int(np.prod(self.measured.shape[1:]))

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        if not isinstance(data.readings, PictureReadings):
            return np.zeros(len(data), bool)
        return np.asarray(data.readings.seen.any((1, 2)))

    @classmethod
    def of(cls, data: Dataset) -> "PixelObservation":
        own = PictureReadings.of(data)
        session = np.full(len(data), "") if data.session is None else data.session
        return cls(own.pixels, own.sight, own.rig, session)

    @cached_property
    def placements(self) -> tuple[tuple[Placement, ...], tuple[Placement, ...]]:
        """Poses of the cameras, and of the boards."""
        there = np.isfinite(self.measured[..., 0])
        boards = np.stack([there[:, :, part].any((1, 2)) for _, part in self.rig.parts], axis=1)
        held = tuple(self._poses_of(self.rig.targets, boards))
        return tuple(self._poses_of(self.rig.cameras, there.any(2))), held

    def _poses_of(self, parts: Sequence[Camera | PictureTarget], seen: np.ndarray) -> Iterator[Placement]:
        """Of what no picture shows, or none of a session, there is none."""
        for k, part in enumerate(parts):
            owners = np.array([owner_in(part, session) for session in self.session.tolist()])
            for name in dict.fromkeys(owners[seen[:, k]].tolist()):
                yield Placement(k, name, owners == name)

    @property
    def seen(self) -> Bool[np.ndarray, "..."]:
        return np.isfinite(self.measured).reshape(len(self.measured), -1)

    @cached_property
    def _entries(self) -> list[tuple[str, Unknown, float]]:
        """Name of each unknown, what is known of it, and where the search begins; poses are placed later."""
        units = ["m"] * 3 + ["rad"] * 3
        poses = product(chain(*self.placements), zip(POSE, units, strict=True))
        found = [(f"{placement.owner}.{part}", Unknown(unit), 0.0) for placement, (part, unit) in poses]
        for camera in (c for c in self.rig.cameras if c.free is not Freedom.FIXED):
            numbers = zip(INTRINSICS, camera.intrinsics.tolist(), camera.sigma.tolist(), strict=True)
            for k, (part, value, std) in enumerate(numbers):
                unit, natural = ("px", float(camera.intrinsics[k % 2])) if k < 4 else ("1", 1.0)
                sigma = std if camera.free is Freedom.AUTO else None
                found.append((f"{camera.owner}.{part}", Unknown(unit, natural, sigma), value))
        for target in (self.rig.targets[k] for k in sorted({board.number for board in self.placements[1]})):
            for part, (unit, sigma, value, _) in target.shape.items():
                known = Unknown(unit, sigma=None if np.isinf(sigma) else sigma)
                found.append((f"{target.owner}.{part}", known, value))
        return found

    @property
    def unknowns(self) -> tuple[str, ...]:
        return tuple(name for name, *_ in self._entries)

    @property
    def known(self) -> Mapping[str, Unknown]:
        return {name: known for name, known, _ in self._entries}

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        placed = np.concatenate(self._placed(poses))
        six = np.hstack([placed[:, :3, 3], se3.matrix_to_rotvec(placed[:, :3, :3])]).ravel()
        return np.array([*six, *(value for *_, value in self._entries[len(six) :])])

    def _placed(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Poses of `placements`: of the pair with most pictures first, and on from there."""
        shown = np.isfinite(self.sight[..., 0, 0])
        eyes, held_by = self.placements
        count = np.array([[shown[e.rows & h.rows, e.number, h.number].sum() for h in held_by] for e in eyes])
        cameras, boards = (np.full((n, 4, 4), np.nan) for n in count.shape)
        while True:
            is_eye, is_board = (np.isfinite(each[:, 0, 0]) for each in (cameras, boards))
            new = count * ~(is_eye[:, None] & is_board)
            if not new.any():
                cameras[~is_eye], boards[~is_board] = np.eye(4), np.eye(4)
                return cameras, boards
            half = new * (is_eye[:, None] | is_board)
            i, j = np.unravel_index(int((half if half.any() else new).argmax()), new.shape)
            c, b = eyes[i].number, held_by[j].number
            rows, camera = shown[:, c, b] & eyes[i].rows & held_by[j].rows, self.rig.cameras[c]
            carried, sight = camera.carried(poses[rows]), self.sight[rows, c, b]
            cameras[i], boards[j], _ = placed(carried, sight, eye=cameras[i], board=boards[j])

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        place, shape = {name: k for k, name in enumerate(self.unknowns)}, self.measured.shape
        residual, by_twist = np.zeros(shape), np.zeros((*shape, 6))
        by_unknown = np.zeros((*shape, len(place)))
        for eye, plate in product(*self.placements):
            camera, (target, part) = self.rig.cameras[eye.number], self.rig.parts[plate.number]
            mine = np.s_[:, eye.number, part]
            there = np.isfinite(self.measured[mine]).all(2) & (eye.rows & plate.rows)[:, None]
            row, spot = np.nonzero(there)
            first, k = place[f"{eye.owner}.x"], place[f"{plate.owner}.x"]
            placement, board = (Placed.at(unknown[n : n + 6]) for n in (first, k))
            bent = [place[f"{target.owner}.{n}"] for n in target.shape]
            moves = np.reshape([own for *_, own in target.shape.values()], (-1, *target.points.shape))
            held = se3.apply(board.pose, target.still + np.tensordot(unknown[bent], moves, 1))
            lens = place.get(f"{camera.owner}.fx")
            intrinsics = camera.intrinsics if lens is None else unknown[lens : lens + 9]
            fixed, carried = camera.mounted is Mount.WORLD, camera.carried(poses)[row]
            q = se3.apply(carried, held[spot])
            from_camera = q - placement.pose[:3, 3]
            at = project(from_camera @ placement.pose[:3, :3], intrinsics)
            residual[mine][row, spot] = self.measured[mine][row, spot] - at.pixel
            by_q = _times(at.by_point, placement.pose[:3, :3].T)
            by_held = by_q @ carried[:, :3, :3]
            place_of, pull = (q, by_q) if fixed else (held[spot], -by_held)
            lever = place_of - poses[row, :3, 3]
            by_twist[mine][row, spot] = np.concatenate([pull, -_turned(pull, lever)], axis=-1)
            out = np.zeros((len(row), 2, len(place)))
            out[..., first : first + 3] = -by_q
            out[..., first + 3 : first + 6] = _times(_turned(by_q, from_camera), placement.turning)
            if lens is not None:
                out[..., lens : lens + 9] = at.by_intrinsics
            out[..., k : k + 3] = by_held
            turned = _turned(by_held, (held - board.pose[:3, 3])[spot])
            out[..., k + 3 : k + 6] = -_times(turned, board.turning)
            by_xi = _times(by_held, board.pose[:3, :3])
            out[..., bent] = np.einsum("nij,knj->nik", by_xi, moves[:, spot])
            by_unknown[mine][row, spot] = out
        rows = len(residual), residual[0].size
        by_unknown = by_unknown.reshape(*rows, len(place))
        return Linearised(residual.reshape(rows), by_twist.reshape(*rows, 6), by_unknown)

    def own_errors(self, seen: Linearised) -> OwnErrors:
        """Root mean square of each picture's corners, and the error of the tool that they suggest.

        Where corners show nothing of s_p or s_r, it is not 0 but as large as they leave it on average.
        """
        none, fixed = np.zeros(0), np.zeros((*seen.residual.shape, 0))
        pictures = Pictures.of(seen.residual, seen.by_twist, self.seen, fixed)
        likelihood = Likelihood(pictures, none, none, np.zeros((0, 0)), none)
        found, corners = likelihood.likeliest(), pictures.count / 2.0
        both = zip(found.noise[:2], NOISE[1:], strict=True)
        sizes = found.sizes[0], *(size if size > 0.0 else likelihood.mean(name) for size, name in both)
        pixel = np.sqrt(pictures.square / np.maximum(corners, 1.0))
        return OwnErrors("pixel[px]", pixel, corners, *pictures.tool_errors(np.array(sizes)))


def _times(rows: Float[np.ndarray, "n 2 3"], matrix: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "n 2 3"]:
    return (rows.reshape(-1, 3) @ matrix).reshape(rows.shape)


def _turned(rows: Float[np.ndarray, "n 2 3"], arm: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2 3"]:
    """Rows times [arm]×: b × a."""
    return np.cross(rows, arm[:, None])

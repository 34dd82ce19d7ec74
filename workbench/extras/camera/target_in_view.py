"""What cameras see of a target at the arm's poses, and what that tells of the arm's constants.

With dT the tool's twist [v; ω] (base axes at the tool's origin) a point p of the target moves by
v + ω × (p − p_tool), and its pixel by H dT. The rows H of all points in sight, divided by the pixels' noise,
are compressed to six a pose, H = Q R: R is the inverse root of the covariance of the pose that a picture
gives. A camera whose place is unknown is a base that is unknown, a target whose place is unknown is a tool;
several cameras count as one rigid rig.

A point is in sight if it lies in the picture and in the sharp depths, and the ray meets its board or tag by
less than 60° from its normal; corners of markers seen more flatly are no longer found.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.linearisation import Linearisation
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import Freedom, frozen
from workbench.extras.camera.camera import Mount
from workbench.extras.camera.observation import PixelObservation, coordinates
from workbench.extras.camera.rig import Rig
from workbench.plate.poses.sight import AbstractSight

SLANT = np.deg2rad(60.0)
"""Greatest angle between a ray and the normal of the board."""
MARGIN = 0.02
"""Border of the picture that is not used, as a part of its size."""
SMALLEST = 15.0
"""A target whose points are nearer to each other than this [px] is too far away."""
WHOLE, TAGS = 0.9, 8
"""Share of a board's points, and number of points of tags, that must be in sight."""
PIXEL = 0.3
"""Noise of corners [px]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TargetInView(AbstractSight):
    """Cameras and a target, and roughly where they are.

    Args:
        rig: Cameras and target.
        cameras: Pose of each camera in what carries it: the measuring frame, or the tool.
        target: Pose of the target in what carries it.
        depth: Nearest and farthest distance at which pictures are sharp [m].
        noise: Standard deviation of a corner [px].
    """

    rig: Rig
    cameras: tuple[Float[np.ndarray, "4 4"], ...]
    target: Float[np.ndarray, "4 4"]
    depth: tuple[float, float] = (0.0, np.inf)
    noise: float = PIXEL
    condition = f"show the target in the picture, sharp and within {np.rad2deg(SLANT):.0f}° of its normal"
    remedy = "correct --camera-at and --target-at, or move camera or target"

    def __post_init__(self):
        if len(self.cameras) != len(self.rig.cameras):
            raise OptionError(
                f"the camera file has {len(self.rig.cameras)} cameras, but {len(self.cameras)} poses are "
                "given; give one for each"
            )
        if len(self.rig.targets) > 1:
            raise OptionError("poses are chosen for one board; give a target file with one board")
        if not 0.0 <= self.depth[0] < self.depth[1]:
            raise OptionError(
                f"sharp depths must go from near to far, got {self.depth[0]:g}, {self.depth[1]:g} m"
            )

    @cached_property
    def inwards(self) -> Float[np.ndarray, "points 3"]:
        """Unit normal of each point's board or tag, away from who sees it; 0 for single points."""
        target = self.rig.targets[0]
        if target.charuco is not None:
            return np.tile([0.0, 0.0, 1.0], (len(target), 1))
        normals = np.zeros((len(target), 3))
        for name in set(target.ids.tolist()):
            own = np.flatnonzero(target.ids == name)
            if len(own) == 4:
                a, b, _, d = target.points[own[np.argsort(target.corners[own])]]
                normals[own] = np.cross(b - a, d - a) / np.linalg.norm(np.cross(b - a, d - a))
        return normals

    @cached_property
    def spacing(self) -> float:
        """Minimum distance between two points of the target [m]."""
        points = self.rig.points
        distance = np.linalg.norm(points[:, None] - points, axis=2)
        return float(distance[distance > 0.0].min())

    def in_camera(self, poses: Float[np.ndarray, "rows 4 4"], camera: int) -> Float[np.ndarray, "rows 4 4"]:
        """Pose of the target in a camera, by the tool's poses."""
        on_tool = self.rig.cameras[camera].mounted is Mount.TOOL
        carried = se3.inverse(poses) if on_tool else poses
        return se3.inverse(self.cameras[camera]) @ carried @ self.target

    def seen(
        self, poses: Float[np.ndarray, "rows 4 4"], camera: int
    ) -> tuple[Float[np.ndarray, "rows points 2"], Bool[np.ndarray, "rows points"]]:
        """Pixels of the target's points, and which of them are in sight."""
        own, at = self.rig.cameras[camera], self.in_camera(poses, camera)
        points = self.rig.points @ at[:, :3, :3].transpose(0, 2, 1) + at[:, None, :3, 3]
        pixel = own.project(points).pixel
        size = np.array(own.size, float)
        inside = ((pixel > MARGIN * size) & (pixel < (1.0 - MARGIN) * size)).all(-1)
        far = min(self.depth[1], float(own.intrinsics[0]) * self.spacing / SMALLEST)
        sharp = (points[..., 2] > max(self.depth[0], 1e-3)) & (points[..., 2] < far)
        normal = self.inwards @ at[:, :3, :3].transpose(0, 2, 1)
        facing = (points * normal).sum(-1) >= np.cos(SLANT) * np.linalg.norm(points, axis=-1)
        return pixel, inside & sharp & (facing | ~self.inwards.any(1))

    def shows(self, poses: Float[np.ndarray, "rows 4 4"]) -> Bool[np.ndarray, " rows"]:
        """At which of the tool's poses some camera sees enough of the target."""
        target = self.rig.targets[0]
        minimum = WHOLE * len(target) if target.charuco is not None else TAGS
        seen = [self.seen(poses, k)[1].sum(1) for k in range(len(self.cameras))]
        return np.max(seen, axis=0) >= min(minimum, len(target))

    def admits(self, robot: Robot, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
        return self.shows(tool_poses(robot, Motion(q)))

    def linearise(
        self, robot: Robot, q: Float[np.ndarray, "rows n"], names: tuple[str, ...] | None = None
    ) -> Linearisation:
        names = robot.default_free if names is None else names
        poses, twists = identification_jacobian(robot, Motion(q), names)
        root = np.linalg.qr(self._by_twist(poses), mode="r")
        return Linearisation(
            jacobian=frozen((root @ twists).reshape(-1, len(names))),
            names=names,
            units=tuple(robot.chain.elements[robot.chain.index[n]].unit for n in names),
            sigma=frozen(np.ones(6 * len(q))),
            measurement=frozen(np.repeat(np.arange(len(q)), 6)),
            length=robot.reach,
        )

    def _by_twist(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, "rows m 6"]:
        """Whitened pixels of all points in sight per twist of the tool."""
        sight = np.stack([self.seen(poses, k)[1] for k in range(len(self.cameras))], axis=1)
        unknown = np.full((*sight.shape[:2], 1, 4, 4), np.nan)
        rig, sessions = self.rig.with_intrinsics(Freedom.FIXED), np.full(len(poses), "")
        observation = PixelObservation(
            np.where(sight[..., None], np.zeros(2), np.nan), unknown, rig, sessions
        )
        values = dict.fromkeys(observation.unknowns, 0.0)
        for placement, pose in zip(chain(*observation.placements), (*self.cameras, self.target), strict=True):
            values |= coordinates(placement.owner, pose)
        return observation.linearise(poses, np.array([*values.values()])).by_twist / self.noise

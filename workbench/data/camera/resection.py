"""Pose of the target in each picture, from that picture alone; contradicting corners are excluded.

Every plane of the target that is in view (a board, or each tag) gives a pose by its homography, and the one
mirrored in depth; six points or more off one plane give one by the direct linear transform. The pose that
suits most corners is refined on all of them, with weights 1/(1 + (e/s)²) that wrong corners hardly move. No
arm takes part, so that a corner is judged by its picture and not by the joints.

Source: Hartley, Zisserman, Multiple View Geometry, 2nd ed., algorithms 4.2 and 7.1.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.hand_eye import nearest_rotation
from workbench.base.wording import listed, plural
from workbench.data.camera.camera import Camera, project
from workbench.data.camera.rig import Apart
from workbench.data.camera.target import Target
from workbench.data.dataset import Dataset

STEPS = 15
"""Gauss–Newton steps of the refinement."""
FAR_OFF = 50.0
"""Corners farther off than this [px] count alike when the first pose is chosen."""
WRONG, LEAST_WRONG = 6.0, 2.0
"""Corners beyond this many standard deviations, and so many px, are set apart."""
USELESS = 5.0
"""Median error of a picture [px] beyond which it shows another target, or beyond which none fits."""
RAYLEIGH = 1.1774
"""Median length of a normal error in the plane, in standard deviations of a coordinate."""
NOTHING_USED = "shows no corner that is used"
"""Why a picture is kept out that showed only boards that are left out, or only wrong corners."""


def with_resected_poses(data: Dataset) -> Dataset:
    """The dataset with poses of every board in every camera, and without the corners that contradict them.

    Boards that fewer than two pictures place are left out, where there are several, and with them the
    pictures that show nothing else.

    Raises:
        DataError: no picture can be explained by target and intrinsics.
    """
    rig, pixels = data.rig, data.pixels
    assert rig is not None, "data without cameras"
    assert pixels is not None, "they come together"
    assert data.image is not None, "they come together"
    pixels, sight = pixels.copy(), np.full((*pixels.shape[:2], len(rig.targets), 4, 4), np.nan)
    apart: list[Apart] = []
    for c, camera in enumerate(rig.cameras):
        for b, (target, part) in enumerate(rig.parts):
            mine = pixels[:, c, part]
            rows = np.flatnonzero(np.isfinite(mine[..., 0]).sum(1) >= 4)
            first = _first_poses(mine[rows], camera, target)
            placed = np.isfinite(first[:, 0, 0, 0])
            rows, seen = rows[placed], mine[rows[placed]]
            if not len(rows):
                continue
            poses = _refined(first[placed], seen, camera, target)
            off = np.linalg.norm(seen - _predicted(poses, camera, target), axis=2)
            lost = _judged(off, data, camera)
            good = (np.isfinite(off) & ~lost).sum(1) >= 4
            sight[rows[good], c, b] = poses[good]
            for i, k in np.argwhere(lost):
                name = int(target.ids[k]), int(target.corners[k])
                apart.append(Apart(str(data.image[rows[i]]), camera.name, *name, float(off[i, k])))
                mine[rows[i], k] = np.nan
    if not np.isfinite(sight).any():
        raise DataError(
            f"{data.source}: no picture shows four corners of the target; none can place the camera"
        )
    apart.sort(key=lambda a: -a.off)
    notes = data.notes
    if apart:
        more = f" and {len(apart) - 5} more" if len(apart) > 5 else ""
        notes += (f"set apart as wrong: {'; '.join(map(str, apart[:5]))}{more}",)
    rig = replace(rig, apart=tuple(apart))
    found = replace(data, pixels=pixels, sight=sight, rig=rig, notes=notes)
    return with_boards_in_view(_without_empty(found))


def with_boards_in_view(data: Dataset, *, fitted: bool = False) -> Dataset:
    """Without the boards that fewer than two pictures place, where there are several.

    Args:
        data: The pictures.
        fitted: Whether they are those left to fit, and the boards may be in others.

    Raises:
        DataError: none is left.
    """
    rig, sight = data.rig, data.sight
    assert rig is not None, "data without cameras"
    assert sight is not None, "they come together"
    count = np.isfinite(sight[data.included, ..., 0, 0]).any(1).sum(0)
    rare = zip(rig.targets, count.tolist(), strict=True)
    total = int(data.included.sum())
    lost = ", ".join(
        f"board '{t.name}' is in {f'{n} of the {total} pictures to fit' if fitted else plural(n, 'picture')}"
        for t, n in rare
        if n < 2
    )
    if not lost or len(rig.targets) == 1:
        return data
    if (count < 2).all():
        raise DataError(f"{data.source}: {lost}; show at least one of them in two pictures or more")
    note = f"{lost}: left out; show each board in {'more pictures' if fitted else 'two pictures or more'}"
    kept = [t.owner for t, n in zip(rig.targets, count, strict=True) if n >= 2]
    return replace(with_boards(data, kept), notes=(*data.notes, note))


def with_boards(data: Dataset, owners: Collection[str]) -> Dataset:
    """With some of its boards only; pictures that show none of them are kept out."""
    rig, pixels, sight = data.rig, data.pixels, data.sight
    assert rig is not None, "data without cameras"
    assert pixels is not None, "they come together"
    assert sight is not None, "they come together"
    kept = [b for b, target in enumerate(rig.targets) if target.owner in owners]
    if len(kept) == len(rig.targets):
        return data
    if not kept:
        names = listed([target.name or "the only one" for target in rig.targets])
        raise DataError(
            f"{data.source}: of its boards ({names}) none is in the pictures to fit; name boards alike in "
            "both target files, and show the same ones"
        )
    points = np.concatenate([np.arange(rig.parts[b][1].start, rig.parts[b][1].stop) for b in kept])
    targets = tuple(rig.targets[b] for b in kept)
    return _without_empty(
        replace(data, pixels=pixels[:, :, points], sight=sight[:, :, kept], rig=replace(rig, targets=targets))
    )


def _without_empty(data: Dataset) -> Dataset:
    """The pictures without a corner kept out, with the reason."""
    assert data.pixels is not None, "data without cameras"
    empty = data.included & ~np.isfinite(data.pixels).any((1, 2, 3))
    if not empty.any():
        return data
    reason = np.full(len(data), "") if data.reason is None else data.reason
    return replace(data, exclude=~data.included | empty, reason=np.where(empty, NOTHING_USED, reason))


def _judged(
    off: Float[np.ndarray, "rows points"], data: Dataset, camera: Camera
) -> Bool[np.ndarray, "rows points"]:
    """Corners to set apart, by their distances from where their pictures' poses put them."""
    of_picture = np.nanmedian(off, axis=1)
    useless = of_picture > USELESS
    if np.median(of_picture) > USELESS:
        raise DataError(
            f"{data.source}: corners lie {np.median(of_picture):.0f} px from where the target and the "
            f"intrinsics of camera '{camera.name}' put them; check squares, ids, a mirrored print, fx and fy"
        )
    points = np.isfinite(off[~useless]).sum(1)
    spare = np.sqrt(np.maximum(2.0 * points - 6.0, 1.0).sum() / (2.0 * points).sum())
    scatter = float(np.nanmedian(off[~useless])) / RAYLEIGH / spare
    with np.errstate(invalid="ignore"):
        lost = off > max(WRONG * scatter, LEAST_WRONG)
    return lost | (useless[:, None] & np.isfinite(off))


def _predicted(poses: Float[np.ndarray, "rows 4 4"], camera: Camera, target: Target) -> np.ndarray:
    return camera.project(se3.apply(poses[:, None], target.points[None])).pixel


def _first_poses(seen: np.ndarray, camera: Camera, target: Target) -> Float[np.ndarray, "rows 2 4 4"]:
    """The best first pose of every picture, and the one mirrored in depth."""
    rays = camera.normalised(seen)
    points = target.points
    first = np.empty((len(seen), 2, 4, 4))
    for i in range(len(seen)):
        there = np.isfinite(rays[i, :, 0])
        tried = []
        for group in target.planar:
            mine = group[there[group]]
            if len(mine) >= 4 and _spread(points[mine]):
                tried.append(_by_homography(points[mine], rays[i, mine]))
        if there.sum() >= 6 and not tried:
            tried.append(_by_transform(points[there], rays[i, there]))
        if not tried:
            first[i] = np.nan
            continue
        poses = np.stack([p for pose in tried for p in (pose, _mirrored(pose, points[there].mean(0)))])
        off = np.linalg.norm(seen[i] - _predicted(poses, camera, target), axis=2)
        best = int(np.argmin(np.nanmean(np.minimum(off, FAR_OFF), axis=1)))
        first[i] = poses[best], poses[best ^ 1]
    return first


def _spread(points: np.ndarray) -> bool:
    """Whether points are not on one line."""
    s = np.linalg.svd(points - points.mean(0), compute_uv=False)
    return bool(s[1] > 0.05 * s[0])


def _by_homography(
    points: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, "4 4"]:
    """Pose of a plane from the rays to its points."""
    middle = points.mean(0)
    axes = np.linalg.svd(points - middle)[2]
    axes[2] *= np.linalg.det(axes)
    h, size = _direct((points - middle) @ axes[:2].T, rays)
    h = h @ np.diag([1.0 / size, 1.0 / size, 1.0])
    h *= 2.0 / (np.linalg.norm(h[:, 0]) + np.linalg.norm(h[:, 1]))
    rotation = nearest_rotation(np.column_stack([h[:, 0], h[:, 1], np.cross(h[:, 0], h[:, 1])]))
    return se3.pose(rotation @ axes, h[:, 2] - rotation @ axes @ middle)


def _by_transform(
    points: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, "4 4"]:
    """Pose from the rays to six points or more that are in no plane."""
    middle = points.mean(0)
    m, size = _direct(points - middle, rays)
    m /= np.linalg.norm(m[:, :3]) / np.sqrt(3.0) / size
    rotation = nearest_rotation(m[:, :3])
    return se3.pose(rotation, m[:, 3] - rotation @ middle)


def _direct(points: Float[np.ndarray, "n d"], rays: Float[np.ndarray, "n 2"]) -> tuple[np.ndarray, float]:
    """The matrix (3, d + 1) that takes points, over the size that is given too, to rays; depths positive."""
    size = float(np.abs(points).max())
    ones = np.column_stack([points / size, np.ones(len(points))])
    nil = np.zeros_like(ones)
    system = np.concatenate(
        [np.hstack([ones, nil, -rays[:, :1] * ones]), np.hstack([nil, ones, -rays[:, 1:] * ones])]
    )
    found = np.linalg.svd(system)[2][-1].reshape(3, -1)
    return found * np.sign(found[2, -1] or 1.0), size


def _mirrored(pose: Float[np.ndarray, "4 4"], middle: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4 4"]:
    """The pose of a plane through the middle that looks nearly alike, its depths the other way round."""
    centre = se3.apply(pose, middle)
    sight = centre / np.linalg.norm(centre)
    turn = 2.0 * np.outer(sight, sight) - np.eye(3)
    rotation = turn @ pose[:3, :3] @ np.diag([-1.0, -1.0, 1.0])
    return se3.pose(rotation, centre - rotation @ middle)


def _refined(
    first: np.ndarray, seen: np.ndarray, camera: Camera, target: Target
) -> Float[np.ndarray, "rows 4 4"]:
    """The better of both first poses after robust Gauss–Newton steps, all pictures at once."""
    there = np.isfinite(seen[..., 0])
    best, least = np.full((len(seen), 4, 4), np.nan), np.full(len(seen), np.inf)
    for poses in np.moveaxis(first, 1, 0):
        for _ in range(STEPS):
            places = se3.apply(poses[:, None], target.points[None])
            at = project(places, camera.intrinsics)
            residual = np.where(there[..., None], seen - at.pixel, 0.0)
            off = np.linalg.norm(residual, axis=2)
            usual = np.nanmedian(np.where(there, off, np.nan), axis=1, keepdims=True)
            weight = there / (1.0 + (off / np.maximum(3.0 * usual, 0.5)) ** 2)
            arm = places - poses[:, None, :3, 3]
            by_pose = at.by_point @ np.concatenate(
                [np.broadcast_to(np.eye(3), (*arm.shape, 3)), -se3.skew(arm)], axis=-1
            )
            by_pose = by_pose.reshape(len(seen), -1, 6)
            heavy = np.repeat(weight, 2, axis=1)[..., None] * by_pose
            normal = np.swapaxes(by_pose, 1, 2) @ heavy
            normal += 1e-6 * np.einsum("rii->ri", normal)[:, :, None] * np.eye(6) + 1e-9 * np.eye(6)
            step = np.linalg.solve(normal, np.swapaxes(heavy, 1, 2) @ residual.reshape(len(seen), -1, 1))[
                ..., 0
            ]
            turn = se3.rotvec_to_matrix(np.clip(step[:, 3:], -0.5, 0.5))
            poses = se3.pose(turn @ poses[:, :3, :3], poses[:, :3, 3] + np.clip(step[:, :3], -0.5, 0.5))
        off = np.linalg.norm(seen - _predicted(poses, camera, target), axis=2)
        cost = np.nanmean(np.minimum(off, FAR_OFF), axis=1)
        better = cost < least
        best[better], least[better] = poses[better], cost[better]
    return best

"""Pose of the target in each picture, from that picture alone; contradicting corners are excluded.

Every plane of the target that is in view (a board, or each tag) gives a pose and the one mirrored in depth by
OpenCV's IPPE; all its points give others by its SQPnP, four or five by its P3P of each three. The pose that
suits most corners is refined on all of them, with weights 1/(1 + (e/s)²) that wrong corners hardly move. No
arm takes part, so that a corner is judged by its picture and not by the joints.

Sources: Collins, Bartoli, Infinitesimal plane-based pose estimation, Int. J. Comput. Vis. 109, 2014;
Terzakis, Lourakis, A consistently fast and globally optimal solution to the perspective-n-point problem, ECCV
2020.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from itertools import combinations, product

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.wording import listed, plural
from workbench.data.dataset import Dataset, Labels
from workbench.extras.camera.camera import Camera, project
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.rig import PictureReadings, RejectedCorner, Rig, off_text, owner_in
from workbench.extras.camera.target import PictureTarget

REFINEMENT_STEPS = 15
"""Gauss–Newton steps of the refinement."""
FAR_OFF = 50.0
"""Corners farther off than this [px] count alike when the first pose is chosen."""
WRONG, MIN_WRONG = 6.0, 2.0
"""Corners beyond this many standard deviations, and so many px, are set apart."""
USELESS = 5.0
"""Median error of a picture [px] beyond which it shows another target, or beyond which none fits."""
OUTVOTED = 6
"""Corners of a picture from which on one that is wrong weighs less: fewer suit a wrong pose without it."""
MIN_BOARD_CORNERS = 12
"""Corners of a board in all pictures together that place it, however few each picture shows."""
RAYLEIGH = 1.1774
"""Median length of a normal error in the plane, in standard deviations of a coordinate."""
NOTHING_USED = "shows no usable corner"
"""Why a picture is kept out that showed only boards that are left out, or only wrong corners."""


def with_corners(
    data: Dataset, pixels: Float[np.ndarray, "rows cameras points 2"], image: Labels, rig: Rig
) -> Dataset:
    """Rows of joints with their pictures: each board's pose in each camera, contradicting corners set apart.

    Boards that fewer than two pictures place are left out, where there are several, and with them the
    pictures that show nothing else.
    """
    pixels, sight = pixels.copy(), np.full((*pixels.shape[:2], len(rig.targets), 4, 4), np.nan)
    rejected: list[RejectedCorner] = []
    for c, camera in enumerate(rig.cameras):
        for b, (target, part) in enumerate(rig.parts):
            mine = pixels[:, c, part]
            rows, poses, off = placed_alone(np.where(target.placing[:, None], mine, np.nan), camera, target)
            if not len(rows):
                continue
            lost = _judged(off, data, camera)
            good = (np.isfinite(off) & ~lost).sum(1) >= 4
            sight[rows[good], c, b] = poses[good]
            for i, k in np.argwhere(lost):
                name = int(target.ids[k]), int(target.corners[k])
                rejected.append(RejectedCorner(str(image[rows[i]]), camera.name, *name, float(off[i, k])))
                mine[rows[i], k] = np.nan
    rejected.sort(key=lambda a: -a.off)
    notes = data.notes
    if rejected:
        more = f" and {len(rejected) - 5} more" if len(rejected) > 5 else ""
        notes += (f"rejected: {'; '.join(map(str, rejected[:5]))}{more}",)
    rig = replace(rig, rejected=tuple(rejected))
    found = replace(data, readings=PictureReadings(pixels, image, rig, sight), notes=notes)
    return with_boards_in_view(_without_empty(found))


def placed_alone(
    seen: Float[np.ndarray, "rows points 2"], camera: Camera, target: PictureTarget
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 4 4"], Float[np.ndarray, "n points"]]:
    """Pictures whose four points or more place the target, its poses, and how far off points are [px].

    Points on a line, such as a board's only row in view, do not.
    """
    rows = np.flatnonzero([_spans_plane(target.points[there]) for there in np.isfinite(seen[..., 0])])
    first = _first_poses(seen[rows], camera, target)
    placed = np.isfinite(first[:, 0, 0, 0])
    rows = rows[placed]
    poses = _refined(first[placed], seen[rows], camera, target) if len(rows) else np.zeros((0, 4, 4))
    return rows, poses, np.linalg.norm(seen[rows] - _predicted(poses, camera, target), axis=2)


def with_boards_in_view(data: Dataset, *, fitted: bool = False) -> Dataset:
    """Without the boards that fewer than two pictures place, where there are several.

    Args:
        data: The pictures.
        fitted: Whether they are those left to fit, and the boards may be in others.
    """
    own = PictureReadings.of(data)
    rig = own.rig
    sight, seen = own.sight[data.included], own.seen[data.included]
    count = np.isfinite(sight[..., 0, 0]).any(1).sum(0)
    for b, (_, part) in enumerate(rig.parts):
        if seen[:, :, part].sum() >= MIN_BOARD_CORNERS:
            count[b] = max(count[b], seen[:, :, part].any((1, 2)).sum())
    rare = zip(rig.targets, count.tolist(), strict=True)
    total = int(data.included.sum())
    lost = ", ".join(
        f"board '{t.name}' is in {f'{n} of the {total} pictures to fit' if fitted else plural(n, 'picture')}"
        for t, n in rare
        if n < 2
    )
    if not lost or len(rig.targets) == 1:
        return with_sessions_in_view(data)
    if (count < 2).all():
        raise DataError(f"{data.source}: {lost}; show at least one of them in two pictures or more")
    note = f"{lost}: left out; show each board in {'more pictures' if fitted else 'two pictures or more'}"
    kept = [t.owner for t, n in zip(rig.targets, count, strict=True) if n >= 2]
    return with_sessions_in_view(replace(with_boards(data, kept), notes=(*data.notes, note)))


def with_sessions_in_view(data: Dataset, fewest: int = 2, known: Collection[str] = ()) -> Dataset:
    """Without the corners that would place a camera or board for a session by fewer pictures than that.

    Args:
        data: The pictures.
        fewest: Pictures that are enough.
        known: Poses that other pictures place, as the names of their unknowns begin.
    """
    own = PictureReadings.of(data)
    pixels, sight, notes = own.pixels.copy(), own.sight.copy(), []
    parts: list[tuple[Camera | PictureTarget, np.ndarray, np.ndarray]] = []
    parts += [(part, pixels[:, c], sight[:, c]) for c, part in enumerate(own.rig.cameras)]
    parts += [(t, pixels[:, :, mine], sight[:, :, b]) for b, (t, mine) in enumerate(own.rig.parts)]
    for (part, seen, placed), session in product(parts, data.sessions):
        shown = data.in_session(session) & np.isfinite(seen[..., 0]).any(tuple(range(1, seen.ndim - 1)))
        rows = np.flatnonzero(data.included & shown)
        if part.per_session and owner_in(part, session) not in known and 0 < len(rows) < fewest:
            seen[rows], placed[rows] = np.nan, np.nan
            notes.append(
                f"session '{session}' has {plural(len(rows), 'picture')} for its own pose of {part.owner}: "
                f"left out; take at least {fewest}"
            )
    if not notes:
        return data
    return _without_empty(
        replace(data, readings=replace(own, pixels=pixels, sight=sight), notes=(*data.notes, *notes))
    )


def with_boards(data: Dataset, owners: Collection[str]) -> Dataset:
    """With some of its boards only; pictures that show none of them are kept out."""
    own = PictureReadings.of(data)
    rig = own.rig
    kept = [b for b, target in enumerate(rig.targets) if target.owner in owners]
    if len(kept) == len(rig.targets):
        return data
    if not kept:
        names = listed([target.name or "the only one" for target in rig.targets])
        raise DataError(
            f"{data.source}: none of its boards ({names}) is in the pictures to fit; show the same boards, "
            "with the same names in both target files"
        )
    points = np.concatenate([np.arange(rig.parts[b][1].start, rig.parts[b][1].stop) for b in kept])
    rig = replace(rig, targets=tuple(rig.targets[b] for b in kept))
    own = replace(own, pixels=own.pixels[:, :, points], sight=own.sight[:, :, kept], rig=rig)
    return _without_empty(replace(data, readings=own))


def _without_empty(data: Dataset) -> Dataset:
    """The pictures without a corner kept out, with the reason."""
    empty = data.included & ~PictureReadings.of(data).seen.any((1, 2))
    return kept_out(data, {int(i): NOTHING_USED for i in np.flatnonzero(empty)})


def kept_out(data: Dataset, reasons: Mapping[int, str]) -> Dataset:
    """With some more rows kept out, each with its reason."""
    if not reasons:
        return data
    reason = np.full(len(data), "", object) if data.reason is None else data.reason.astype(object)
    exclude = ~data.included
    for row, text in reasons.items():
        exclude[row], reason[row] = True, text
    return replace(data, exclude=exclude, reason=reason.astype(str))


def _judged(
    off: Float[np.ndarray, "rows points"], data: Dataset, camera: Camera
) -> Bool[np.ndarray, "rows points"]:
    """Corners to set apart, by their distances from where their pictures' poses put them."""
    of_picture = np.nanmedian(off, axis=1)
    useless = of_picture > USELESS
    if np.median(of_picture) > USELESS:
        raise DataError(
            f"{data.source}: corners are {off_text(np.median(of_picture))} off what the target and the "
            f"intrinsics of camera '{camera.name}' predict; check squares, ids, a mirrored print, fx and fy"
        )
    points = np.isfinite(off[~useless]).sum(1)
    spare = np.sqrt(np.maximum(2.0 * points - 6.0, 1.0).sum() / (2.0 * points).sum())
    scatter = float(np.nanmedian(off[~useless])) / RAYLEIGH / spare
    with np.errstate(invalid="ignore"):
        lost = off > max(WRONG * scatter, MIN_WRONG)
    return lost | (useless[:, None] & np.isfinite(off))


def _predicted(poses: Float[np.ndarray, "rows 4 4"], camera: Camera, target: PictureTarget) -> np.ndarray:
    return camera.project(se3.apply(poses[:, None], target.points[None])).pixel


def _first_poses(seen: np.ndarray, camera: Camera, target: PictureTarget) -> Float[np.ndarray, "rows 2 4 4"]:
    """The best first pose of every picture, and the other one of its plane, mirrored in depth."""
    cv2 = opencv()
    rays, points = camera.normalised(seen), target.points
    first = np.full((len(seen), 2, 4, 4), np.nan)
    for i in range(len(seen)):
        there = np.isfinite(rays[i, :, 0])
        planes = [mine for group in target.planar if _spans_plane(points[mine := group[there[group]]])]
        groups = [(mine, cv2.SOLVEPNP_IPPE) for mine in planes]
        if there.sum() >= 4:
            groups.append((np.flatnonzero(there), cv2.SOLVEPNP_SQPNP))
        pairs = [p for mine, method in groups if len(p := _solved(points[mine], rays[i, mine], method))]
        if pairs:
            poses = np.concatenate(pairs)
            off = np.linalg.norm(seen[i] - _predicted(poses, camera, target), axis=2)
            best = int(np.argmin(np.nanmean(np.minimum(off, FAR_OFF), axis=1)))
            first[i] = poses[best], poses[best ^ 1]
    return first


def _spans_plane(points: np.ndarray) -> bool:
    """Whether points are four or more, and not on one line."""
    if len(points) < 4:
        return False
    s = np.linalg.svd(points - points.mean(0), compute_uv=False)
    return bool(s[1] > 0.05 * s[0])


def _solved(
    points: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 2"], method: int
) -> Float[np.ndarray, "solutions 4 4"]:
    """Poses by one of OpenCV's solvers in pairs: the two best, or each twice; none where it fails."""
    cv2 = opencv()
    groups, lens = [list(range(len(points)))], (np.eye(3), None)
    if method == cv2.SOLVEPNP_SQPNP and len(points) < OUTVOTED:  # a body of few points suits several poses
        groups, method = [list(three) for three in combinations(range(len(points)), 3)], cv2.SOLVEPNP_P3P
    found = []
    for mine in groups:
        try:
            if method == cv2.SOLVEPNP_P3P:
                _, turns, places = cv2.solveP3P(points[mine], rays[mine], *lens, flags=method)
            else:
                _, turns, places, _ = cv2.solvePnPGeneric(points[mine], rays[mine], *lens, flags=method)
        except cv2.error:  # SQPnP refuses rays close together
            _, turns, places, _ = cv2.solvePnPGeneric(
                points[mine], rays[mine], *lens, flags=cv2.SOLVEPNP_EPNP
            )
        pairs = zip(turns, places, strict=True)
        poses = (se3.pose(se3.rotvec_to_matrix(r.ravel()), t.ravel()) for r, t in pairs)
        found += [pose for pose in poses if np.isfinite(pose).all()]
    is_pair = method == cv2.SOLVEPNP_IPPE and len(found) > 1
    return np.array(found[:2] if is_pair else np.repeat(found, 2, axis=0)).reshape(-1, 4, 4)


def _refined(
    first: np.ndarray, seen: np.ndarray, camera: Camera, target: PictureTarget
) -> Float[np.ndarray, "rows 4 4"]:
    """The better of both first poses after robust damped steps, all pictures at once."""
    there = np.isfinite(seen[..., 0])
    is_robust = there.sum(1, keepdims=True) >= OUTVOTED
    best, minimum = np.full((len(seen), 4, 4), np.nan), np.full(len(seen), np.inf)
    for poses in np.moveaxis(first, 1, 0):
        damping = np.full(len(seen), 1e-3)
        for _ in range(REFINEMENT_STEPS):
            residual, by_pose = _slopes(poses, seen, camera, target)
            off = np.linalg.norm(residual, axis=2)
            usual = np.nanmedian(np.where(there, off, np.nan), axis=1, keepdims=True)
            size = np.where(is_robust, np.maximum(3.0 * usual, 0.5), np.inf)
            weight = there / (1.0 + (off / size) ** 2)
            heavy = np.repeat(weight, 2, axis=1)[..., None] * by_pose
            normal = np.swapaxes(by_pose, 1, 2) @ heavy
            normal += damping[:, None, None] * np.einsum("rii->ri", normal)[:, :, None] * np.eye(6)
            right = np.swapaxes(heavy, 1, 2) @ residual.reshape(len(seen), -1, 1)
            step = np.linalg.solve(normal + 1e-9 * np.eye(6), right)[..., 0]
            turn = se3.rotvec_to_matrix(np.clip(step[:, 3:], -0.5, 0.5))
            tried = se3.pose(turn @ poses[:, :3, :3], poses[:, :3, 3] + np.clip(step[:, :3], -0.5, 0.5))
            after = np.linalg.norm(seen - _predicted(tried, camera, target), axis=2)
            is_better = _robust_cost(after, size) < _robust_cost(np.where(there, off, np.nan), size)
            poses = np.where(is_better[:, None, None], tried, poses)
            damping = np.clip(damping * np.where(is_better, 0.1, 10.0), 1e-9, 1e6)
        off = np.linalg.norm(seen - _predicted(poses, camera, target), axis=2)
        cost = np.nanmean(np.minimum(off, FAR_OFF), axis=1)
        better = cost < minimum
        best[better], minimum[better] = poses[better], cost[better]
    return best


def _robust_cost(off: np.ndarray, size: np.ndarray) -> Float[np.ndarray, " rows"]:
    """Of every picture: errors beyond `size` count less and less; all alike where it is infinite."""
    with np.errstate(invalid="ignore"):
        cost = np.where(np.isfinite(size), size**2 * np.log1p((off / size) ** 2), off**2)
    return np.nansum(cost, axis=1)


def _slopes(
    poses: np.ndarray, seen: np.ndarray, camera: Camera, target: PictureTarget
) -> tuple[Float[np.ndarray, "rows points 2"], Float[np.ndarray, "rows twice 6"]]:
    """Residuals, 0 where nothing was seen, and the change of pixels per twist about each pose's origin."""
    places = se3.apply(poses[:, None], target.points[None])
    at = project(places, camera.intrinsics)
    residual = np.where(np.isfinite(seen), seen - at.pixel, 0.0)
    arm = places - poses[:, None, :3, 3]
    turning = np.concatenate([np.broadcast_to(np.eye(3), (*arm.shape, 3)), -se3.skew(arm)], axis=-1)
    return residual, (at.by_point @ turning).reshape(len(seen), -1, 6)

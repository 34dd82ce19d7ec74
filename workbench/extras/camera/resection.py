"""Poses from pictures: of the target in each picture alone, then of camera and board in what carries them.

Points in one plane (a board, or a tag alone) give a pose and the one mirrored in depth by OpenCV's IPPE;
RANSAC gives another. The pose that suits most corners, refined on those that suit it, is taken. No arm takes
part, so that a corner is judged by its picture and not by the joints, and one that contradicts its picture is
excluded.

Hand–eye in closed form then gives the poses of camera and board. If some pictures contradict that, it is
found from any three of them, so that wrong pictures spoil some only, and then from all that suit the one by
which the best two fifths err least.

Sources: Collins, Bartoli, Infinitesimal plane-based pose estimation, Int. J. Comput. Vis. 109, 2014;
Fischler, Bolles, Random sample consensus, Comm. ACM 24(6), 1981.
"""

from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.hand_eye import base_and_tool, mean_base
from workbench.base.wording import plural
from workbench.data.dataset import Dataset, Labels
from workbench.extras.camera.camera import Camera, as_opencv, opencv, project
from workbench.extras.camera.rig import PictureReadings, RejectedCorner, Rig, owner_in
from workbench.extras.camera.target import PictureTarget

Pose = Float[np.ndarray, "4 4"]
Poses = Float[np.ndarray, "rows 4 4"]

FAR_OFF = 50.0
"""Corners farther off than this [px] count alike when a pose is chosen."""
WRONG, MIN_WRONG = 6.0, 2.0
"""Corners beyond this many standard deviations, and so many px, are set apart."""
NEAR, NEAR_ROUNDS = 3.0, 3
"""Corners beyond this many medians, and `MIN_WRONG`, take no part in the refinement of a pose; its rounds."""
USELESS = 5.0
"""Median error of a picture [px] beyond which it shows another target, or beyond which none fits."""
OUTVOTED = 6
"""Corners of a picture from which on one that is wrong is left out: fewer suit a wrong pose without it."""
WIDE, FLAT = 0.05, 1e-6
"""Width of points relative to their length from which on they place a target: a board's only row doesn't; and
depth up to which they lie in a plane."""
RAYLEIGH = 1.1774
"""Median length of a normal error in the plane, in standard deviations of a coordinate."""


def with_corners(
    data: Dataset, pixels: Float[np.ndarray, "rows cameras points 2"], image: Labels, rig: Rig
) -> Dataset:
    """Rows of joints with their pictures: each board's pose in each camera, contradicting corners set apart.

    Cameras and boards that too few pictures place are left out, and with them the pictures that show nothing
    else.
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
    return with_parts_in_view(_without_empty(found))


def placed_alone(
    seen: Float[np.ndarray, "rows points 2"], camera: Camera, target: PictureTarget
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 4 4"], Float[np.ndarray, "n points"]]:
    """Pictures whose four points or more place the target, its poses, and how far off points are [px]."""
    found = {}
    for row, pixels in enumerate(seen):
        there = np.flatnonzero(np.isfinite(pixels[:, 0]))
        tried = [(pose, _off(pose, pixels, camera, target)) for pose in _poses(pixels, there, camera, target)]
        if tried:
            found[row] = min(tried, key=lambda each: np.nanmean(np.minimum(each[1], FAR_OFF)))
    poses = np.reshape([pose for pose, _ in found.values()], (-1, 4, 4))
    return np.array([*found], int), poses, np.reshape([off for _, off in found.values()], (-1, len(target)))


def _off(pose: Pose, seen: np.ndarray, camera: Camera, target: PictureTarget) -> Float[np.ndarray, " points"]:
    there = project(se3.apply(pose, target.points), camera.intrinsics).pixel
    return np.linalg.norm(there - seen, axis=1)


def _poses(pixels: np.ndarray, there: np.ndarray, camera: Camera, target: PictureTarget) -> Iterator[Pose]:
    """Poses of the target in a picture by its plane and by RANSAC, refined on what suits."""
    cv2, lens, points = opencv(), as_opencv(camera.intrinsics), target.points
    if len(there) < 4:
        return
    length, width, depth = np.linalg.svd(points[there] - points[there].mean(0), compute_uv=False)
    if width <= WIDE * length:
        return
    found, given = list[tuple[np.ndarray, np.ndarray]](), (points[there], pixels[there], *lens)
    if depth <= FLAT * length:
        _, turns, places, _ = cv2.solvePnPGeneric(*given, flags=cv2.SOLVEPNP_IPPE)
        found += zip(turns, places, strict=True)
    with suppress(cv2.error):  # points close together
        _, *one, _ = cv2.solvePnPRansac(*given, flags=cv2.SOLVEPNP_SQPNP)
        found.append((one[0], one[1]))
    for turn, place in found:
        near = there
        for _ in range(NEAR_ROUNDS):
            turn, place = cv2.solvePnPRefineLM(points[near], pixels[near], *lens, turn.copy(), place.copy())
            pose = se3.pose(se3.rotvec_to_matrix(turn.ravel()), place.ravel())
            off = _off(pose, pixels, camera, target)[there]
            if not np.isfinite(off).all():  # no pose, or one with a point behind the camera
                break
            if len(there) >= OUTVOTED:
                near = there[off <= max(NEAR * float(np.median(off)), MIN_WRONG)]
        else:
            yield pose


def _judged(
    off: Float[np.ndarray, "rows points"], data: Dataset, camera: Camera
) -> Bool[np.ndarray, "rows points"]:
    """Corners to set apart, by their distances from where their pictures' poses put them."""
    of_picture = np.nanmedian(off, axis=1)
    useless = of_picture > USELESS
    if np.median(of_picture) > USELESS:
        off_by = f"corners are {np.median(of_picture):.3g} px off what the target and the intrinsics of"
        check = "check squares, ids, a mirrored print, fx and fy"
        raise DataError(f"{data.source}: {off_by} camera '{camera.name}' predict; {check}")
    points = np.isfinite(off[~useless]).sum(1)
    spare = np.sqrt(np.maximum(2.0 * points - 6.0, 1.0).sum() / (2.0 * points).sum())
    scatter = float(np.nanmedian(off[~useless])) / RAYLEIGH / spare
    with np.errstate(invalid="ignore"):
        lost = off > max(WRONG * scatter, MIN_WRONG)
    return lost | (useless[:, None] & np.isfinite(off))


def with_parts_in_view(data: Dataset, fewest: int = 2, known: Collection[str] = ()) -> Dataset:
    """Without the corners that would place a camera or board, in a session of its own, by fewer pictures.

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
        owner = owner_in(part, session)
        mine = data.included & (data.in_session(session) | (owner == part.owner))
        rows = np.flatnonzero(mine & np.isfinite(seen[..., 0]).any(tuple(range(1, seen.ndim - 1))))
        count = int((mine & np.isfinite(placed[..., 0, 0]).any(1)).sum())
        if owner not in known and len(rows) and count < fewest:
            seen[rows], placed[rows] = np.nan, np.nan
            pictures = f"{plural(count, 'picture')} with four points or more"
            notes.append(f"{owner} is in {pictures}: left out; take at least {fewest}")
    if not notes:
        return data
    found = replace(own, pixels=pixels, sight=sight)
    return _without_empty(replace(data, readings=found, notes=(*data.notes, *notes)))


def _without_empty(data: Dataset) -> Dataset:
    """Pictures that showed only boards that are left out, or only wrong corners, kept out."""
    empty = data.included & ~PictureReadings.of(data).seen.any((1, 2))
    return data.kept_out({int(i): "shows no usable corner" for i in np.flatnonzero(empty)})


SAMPLES, MIN_POSES, SURE = 60, 3, 0.4
"""Draws of so many pictures, from which camera and board are placed; share of pictures that are not wrong."""
SUITS, FAR, WEIGHTS = 6.0, 0.05, np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
"""Times what the sure ones are off, and metres, within which pictures suit poses of camera and board; metres
that a turn counts."""


def placed(carried: Poses, sight: Poses, *, eye: Pose, board: Pose) -> tuple[Pose, Pose, np.ndarray]:
    """Poses of camera and board that suit most pictures, in closed form, and which these are.

    Args:
        carried: What carries the board past the camera.
        sight: Pose of the board in the camera by each picture alone.
        eye: Pose of the camera, if known; else NaN …
        board: … and of the board.
    """
    is_known = [np.isfinite(pose).all() for pose in (eye, board)]
    fewest, every = 1 if any(is_known) else MIN_POSES, np.arange(len(sight))

    def by(rows: np.ndarray) -> tuple[Pose, Pose]:
        past, alone = carried[rows], sight[rows]
        held = board if any(is_known) else base_and_tool(past, alone)[1]
        there = eye if is_known[0] else mean_base(alone, past @ held)
        if np.isfinite(held).all():
            return there, held
        return there, mean_base(np.tile(np.eye(4), (len(rows), 1, 1)), se3.inverse(past) @ there @ alone)

    def off(there: Pose, held: Pose) -> Float[np.ndarray, " rows"]:
        return np.linalg.norm(se3.pose_error(sight, se3.inverse(there) @ carried @ held) * WEIGHTS, axis=1)

    sure, best = partial(np.quantile, q=SURE), off(*by(every))
    if len(every) > fewest and best.max() > min(SUITS * sure(best), FAR):
        draw = np.random.default_rng(0)
        rows = (draw.choice(every, fewest, replace=False) for _ in range(SAMPLES))
        best = min((best, *(off(*by(each)) for each in rows)), key=sure)
    suits = np.flatnonzero(best <= SUITS * sure(best))
    suits = suits if len(suits) >= fewest else every
    return *by(suits), suits

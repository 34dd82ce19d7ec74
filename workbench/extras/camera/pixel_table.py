"""Corners that were found in pictures, and the joints at which these were taken, as a `Dataset`.

A row of the dataset is one picture, or the pictures that several cameras took at once. Where the table has
poses of the tool (x y z and an orientation) in place of joints, the arm is one of three slides and three
turns that reach these poses: camera and target can be found, of the arm nothing.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path, PurePath

import numpy as np
from jaxtyping import Int

from workbench.base import se3
from workbench.base.errors import DataError, FileError
from workbench.base.remedy import remedy
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.base.wording import listed, plural, span
from workbench.data.dataset import Dataset
from workbench.data.readers.assemble import assemble
from workbench.data.readers.columns_option import Joints
from workbench.data.readers.fields import Fields
from workbench.data.readers.headings import PIXEL_LABELS, is_observed
from workbench.data.readers.orientation import read_orientation
from workbench.data.readers.read import read_fields
from workbench.extras.camera.corner_detection import find_corners, picture_files, readable
from workbench.extras.camera.lens import with_assumed, with_lenses
from workbench.extras.camera.resection import with_corners
from workbench.extras.camera.rig import Rig

CENTRE_SIGMA, GUESSED_SIGMA = 0.03, 0.15
"""How well a lens's centre is known from the size of pictures, and of a table's corners, per width."""
STRANGE = 0.02
"""Share of corners with unknown names from which on the target is called the wrong one."""
SAME_JOINTS = 1e-6
"""Joints of the rows of one picture may differ by this [rad or m]."""


def read_pixels(
    source: str | PathLike, rig: Rig, *, joints: str | PathLike | None = None, dof: Joints = None
) -> Dataset:
    """Measurements of a table of pixels, or of the corners in pictures.

    Args:
        source: A folder of pictures, or a file of corners in rows `image, camera, id, corner, u[px], v[px]`.
        rig: Cameras and target; the lens of a camera that no file describes is started from the pictures.
        joints: A file of one row a picture; None: joints stand in the rows of the pixels.
        dof: The robot, the names of its joints in order, or their number; None: as many as the file names.

    Raises:
        WorkbenchError: a file can't be read, or pictures, joints, cameras and target don't belong together.
    """
    beside = None if joints is None else read_fields(joints, joints=dof)
    if beside is not None and beside.missing_units and Path(joints or "").is_dir():  # as programs write
        note = f"numbers without units are read in {', '.join(dict.fromkeys(beside.units.values()))}"
        beside = replace(beside, missing_units="", notes=(*beside.notes, note))
    beside = beside and beside.said
    if Path(source).is_dir():
        if beside is None:
            text = f"pictures need the joints at which they were taken; {_give_joints()}"
            raise FileError(text, path=str(source))
        named = beside.values.get("image", np.zeros(0, str)).tolist()
        if not rig.cameras:
            files = list(picture_files(Path(source), rig, named))
            sizes = [each.shape[::-1] for each in readable(files[:5], {files[0][0]: None})] or [(640, 480)]
            rig = with_assumed(rig, [""], max(sizes, key=sizes.count), CENTRE_SIGMA)
        corners, pictures = find_corners(Path(source), rig, named)
        return pixel_data(corners, rig, beside, pictures, dof=dof)
    fields = read_fields(source, layout="plain").said
    if missing := [key for key in ("image", "id", "u", "v") if key not in fields.values]:
        heading = {"u": "u[px]", "v": "v[px]"}.get(missing[0], missing[0])
        raise FileError(f"a table of pixels needs the column '{heading}'", path=fields.source)
    _whole(fields, "id")  # before their joints are
    return pixel_data(fields, rig, beside or _one_a_picture(fields), dof=dof)


def _whole(fields: Fields, key: str) -> Int[np.ndarray, " rows"]:
    """Numbers of boards' corners or of tags; 0 without such a column."""
    cells = [text.removesuffix(".0") or "0" for text in fields.values.get(key, [""] * fields.rows)]
    for row in (k for k, cell in enumerate(cells) if not re.fullmatch(r"[-+]?\d{1,18}", cell)):
        raise fields.error(f"'{cells[row][:40]}' is not a whole number of at most 18 digits", row, key)
    return np.array([*map(int, cells)], int)


@one_thread()
def pixel_data(
    rows: Fields, rig: Rig, joints: Fields, pictures: Sequence[str] = (), *, dof: Joints = None
) -> Dataset:
    """Corners and joints as a `Dataset`, a row a picture in the order of the joints; arguments as above.
    Pictures are all that were looked at; none: those that show corners."""
    shown, uv = plain_names(rows.values["image"]), np.stack([rows.values["u"], rows.values["v"]], axis=1)
    taken = [*dict.fromkeys(plain_names(pictures) or shown)]
    names, notes = _names(rows, joints, taken, shown)
    cameras = rows.values.get("camera", np.full(rows.rows, "")).tolist()
    if not rig.cameras:
        size = (np.nanmax(uv, axis=0, initial=0.0).astype(int) + 1).tolist()
        rig = with_assumed(rig, cameras, (size[0], size[1]), GUESSED_SIGMA)
    place, camera, strange = _points(rows, cameras, rig)
    picture = {name: k for k, name in enumerate(names)}
    row = np.array([picture[name] for name in shown])
    known = (place >= 0) & np.isfinite(uv).all(1)
    pixels = np.full((len(names), len(rig.cameras), len(rig.names), 2), np.nan)
    where = row[known], camera[known], place[known]
    flat = np.ravel_multi_index(where, pixels.shape[:3])
    if len(twice := np.flatnonzero(np.bincount(flat) > 1)):
        r, _, p = np.unravel_index(twice[0], pixels.shape[:3])
        corner = "id {} corner {}".format(*rig.names[p])
        raise DataError(f"{rows.source}: image '{names[r]}' has {corner} twice; delete one")
    pixels[where] = uv[known]
    count = np.isfinite(pixels[..., 0]).sum((1, 2))
    rig, assumed = with_lenses(rig, pixels)
    joints, posed = _driven(joints)
    data = assemble(joints, joints=6 if posed else dof, beside={"corners": count[:, None].astype(float)})
    empty = data.included & (count == 0)
    lost = [name for name, out in zip(names, empty, strict=True) if out and name not in taken]
    notes += strange
    if lost:
        of = f"{len(lost)} of {plural(rows_in_use := int(data.included.sum()), 'row')}"
        lack = f"{of} of {PurePath(joints.source).name} without a picture: {listed(lost, longest=5)}"
        if 2 * len(lost) > rows_in_use:
            raise DataError(f"{lack}; add the pictures, or delete these rows")
        notes += [f"{lack}; left out"]
    own = [part.owner for part in rig.posed if part.per_session]
    if own and data.session is None:
        notes += [f"{listed(own)} has per_session = true, but no row names its session: one pose for all"]
    own_notes = (n for n in data.notes if n not in rows.notes)
    data = replace(data, source=rows.source, notes=(*rows.notes, *own_notes, *assumed, *notes, *posed))
    data = data.kept_out(dict.fromkeys(np.flatnonzero(empty).tolist(), "has no corners in a picture"))
    return with_corners(data, pixels, np.array(names), replace(rig, tool_poses=bool(posed)))


def _names(rows: Fields, joints: Fields, taken: list[str], shown: list[str]) -> tuple[list[str], list[str]]:
    """Name of every row of joints' picture, and what was decided."""
    notes = list[str]()
    both = f"{joints.source} has joints of {joints.rows} pictures, {rows.source} has {len(taken)}"
    names, labels = plain_names(joints.values.get("image", ())), joints.unread.items()
    if not names and (key := next((k for k, own in labels if {*plain_names(own)} == {*taken}), "")):
        names, notes = plain_names(joints.unread[key]), [f"joints are taken from {joints.source} by '{key}'"]
    if not names:
        if len(taken) != joints.rows:
            text = f"{both}; give one row of joints per picture, best with a column 'image'"
            raise DataError(text, found=(joints.rows, len(taken)))
        note = "joints have no column 'image': the first row is assigned to the first picture, and so on"
        return taken, [note]
    if len(set(names)) < len(names):
        again = next(name for name in names if names.count(name) > 1)
        raise DataError(f"{joints.source}: image '{again}' has joints twice; give one row per picture")
    lacking = [name for name in dict.fromkeys(shown) if name not in set(names)]
    if lacking:
        text = f"{both}: {listed(lacking, longest=3)} have no joints; add or delete them"
        raise DataError(text, column="image", found=tuple(lacking))
    return names, notes


def plain_names(names: Iterable) -> list[str]:
    """Names of pictures without folder, ending and leading zeros: 'shots/007.png' is '7'."""
    ending = re.compile(r"\.(png|jpe?g|bmp|tiff?|pgm|webp|0+)$", re.I)
    stems = [ending.sub("", PurePath(str(name)).name) for name in names]
    return [stem.lstrip("0") or "0" if stem.isdigit() else stem for stem in stems]


def _points(rows: Fields, cameras: list[str], rig: Rig) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Number of every corner's point (-1 for none) and camera, and what was left out."""
    known = {camera.name: k for k, camera in enumerate(rig.cameras)}
    known |= {"": 0} if len(known) == 1 else {}
    if strange := [name for name in cameras if name not in known]:
        own = listed([camera.name for camera in rig.cameras])
        raise DataError(f"{rows.source}: the camera file has no camera '{strange[0]}'; it has {own}")
    ids, corners = _whole(rows, "id"), _whole(rows, "corner")
    place = rig.points_named(ids, corners)
    lost = place < 0
    if lost.mean() > STRANGE:
        first = int(np.argmax(lost))
        such = f"{int(lost.sum())} of {len(lost)} corners, such as id {ids[first]}"
        text = f"{such} corner {corners[first]}, are not of the target: {rig.text}"
        how = "give the one that was in view"
        raise DataError(f"{rows.source}: {text}; {how}", column="id", found=int(ids[first]))
    unknown = sorted(set(ids[lost].tolist()))[:8]
    notes = [f"{plural(int(lost.sum()), 'corner')} of unknown ids {unknown} are left out"] if unknown else []
    return place, np.array([known[name] for name in cameras], int), notes


def _give_joints() -> str:
    table = "put a table of them, with a column 'image', beside the pictures"
    return remedy("give --joints TABLE", page=table)


def _one_a_picture(fields: Fields) -> Fields:
    """The joints that stand in the rows of the pixels, one row a picture."""
    if not fields.numbers(r"q(\d+)") and "x" not in fields.values:
        raise FileError(f"has no joints: add q1[rad] …, or {_give_joints()}", path=fields.source)
    names = np.array(plain_names(fields.values["image"]))
    _, first, back = np.unique(names, return_index=True, return_inverse=True)
    for key, values in fields.values.items():
        if re.fullmatch(r"q\d+", key):
            off = np.abs(values - values[first][back])
            if (off > SAME_JOINTS).any():
                raise fields.error("rows of one image have different joints", int(np.argmax(off)), key)
    return fields.take(np.sort(first))


def _driven(joints: Fields) -> tuple[Fields, tuple[str, ...]]:
    """The joints alone, as poses beside them are the controller's; or, where only the tool's poses are given,
    those of an arm of slides and turns, and words for it."""
    own = {k: v for k, v in joints.values.items() if not (k in PIXEL_LABELS or is_observed(k))}
    if joints.numbers(r"q(\d+)") or (position := joints.stacked(("x", "y", "z"))) is None:
        beside = [joints.headings.get(key, key) for key in joints.values if is_observed(key)]
        left = f"{span(beside)} beside the joints are left out: what was measured are the pixels"
        return replace(joints, values=own, rotation=None, notes=(*joints.notes, *[left] * bool(beside))), ()
    rotation, notes = read_orientation(joints, usable=np.ones(joints.rows, bool))
    if rotation is None:
        raise DataError(f"{joints.source}: tool poses need an orientation (qw qx qy qz, or roll pitch yaw)")
    q = np.concatenate([position, se3.matrix_to_rpy(rotation)[:, ::-1]], axis=1)
    kept = {key: v for key, v in own.items() if key in ("session", "group", "time", "exclude", "reason")}
    kept |= {f"q{k + 1}": frozen(column) for k, column in enumerate(q.T)}
    text = "no joints, only tool poses: camera and target are identified, the arm can't be"
    return replace(joints, values=kept, rotation=None, notes=(*joints.notes, *notes)), (text,)

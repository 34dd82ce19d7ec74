"""Hand–eye: where a camera is on the hand or in the cell, and the target it sees, from pairs of poses.

    A_i X B_i = Z

A is the hand in the base (for a camera in the cell, the base in the hand), B the target in the camera, X the
camera and Z the target. `pair_fit.py` solves it for either mount; here is what is asked and what is told.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np
import tomli_w
from jaxtyping import Float, Int
from scipy import special

from workbench.arm.frame import Frame
from workbench.base import se3
from workbench.base.arguments import Like, checked_arguments
from workbench.base.array_checks import check_rotations, numbers
from workbench.base.errors import DataError
from workbench.base.files import check_ending, write_text
from workbench.base.hand_eye import nearest_rotation
from workbench.base.wording import in_mm, plural, ranges
from workbench.data.dataset import Dataset
from workbench.data.postures import pose_units, repeats_text
from workbench.extras.camera import pair_fit
from workbench.extras.camera.camera import ON, Mount
from workbench.extras.camera.pair_fit import CLEARLY, FLIPPED, PairFit, fit_pairs
from workbench.extras.camera.pose_pairs import WANTED, read_pairs
from workbench.extras.camera.resection import Poses
from workbench.report.blocks import Block, Sentence, headed, lines
from workbench.report.json import Json, document
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown

ENDINGS = (".yaml", ".yml", ".urdf", ".toml")
"""Of files of a result."""
MAX_METRES = 20.0
"""Lengths are mm where one is larger."""
IN_MM = "lengths of the {}'s poses are read as mm"
MAX_HALF, MAX_LEFT = np.array([5e-3, 0.02]), np.array([0.02, 0.05])
"""Half intervals of the camera, and what the pairs leave, beyond which it should not be used [m, rad]."""
MAX_LISTED, MAX_LOST = 10, 0.25
"""Pairs that are named one by one; share of pairs that don't agree beyond which a shift is tried."""
MAX_SCALE = 0.01
"""Deviation from 1 of the target's scale that may be corrected by it."""
LITTLE, STILL = np.deg2rad((10.0, 1.0))
"""A hand that turned by less about all axes but one (rms) leaves the camera's place along that one open; one
that turned by less about all, altogether."""
FRAMES = {Mount.TOOL: ("hand", "base"), Mount.WORLD: ("base", "hand")}
"""What the camera's pose is in, and the target's."""
YAML = """parameters:
  calibration_type: {kind}
transform:
  translation: {{x: {0}, y: {1}, z: {2}}}
  rotation: {{x: {3}, y: {4}, z: {5}, w: {6}}}
"""
URDF = """<joint name="hand_eye" type="fixed">
  <origin xyz="{0} {1} {2}" rpy="{3} {4} {5}"/>
  <parent link="{parent}"/>
  <child link="camera_optical_frame"/>
</joint>
"""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class HandEye(AbstractShown):
    """A camera in the hand (or in the base), and the target in the base (or in the hand).

    Args:
        mounted: What carries the camera.
        fit: Camera and target, and what is left of the pairs.
        row: Number of each pair as given, from 1; of several of one pose the first.
        margin: How many times worse the pairs fit with the camera mounted otherwise.
        doubt: Why the result should not be used as it is; empty if it may be.
        notes: What else should be known, one sentence each.
    """

    mounted: Mount
    fit: PairFit
    row: Int[np.ndarray, " rows"]
    margin: float
    doubt: str = ""
    notes: tuple[str, ...] = ()

    @property
    def camera(self) -> Frame:
        return Frame.from_pose(self.fit.frames[0])

    @property
    def target(self) -> Frame:
        return Frame.from_pose(self.fit.frames[1])

    @property
    def half(self) -> Float[np.ndarray, "2 6"]:
        """Half of the 95 % intervals of camera and target along and about their parents' axes [m, rad]."""
        return self.fit.half[:12].reshape(2, 6)

    @property
    def sentence(self) -> str:
        where = _with_half("xyz", 1e3 * self.camera.xyz, 1e3 * self.half[0, :3], 2)
        agree = f"{plural(len(self.fit.kept), 'pair')} agree to {_error(self.fit.rms)}"
        return f"camera {ON[self.mounted]} at {where} mm in the {FRAMES[self.mounted][0]}; {agree}"

    def blocks(self) -> list[Block]:
        where = _with_half("xyz", 1e3 * self.target.xyz, 1e3 * self.half[1, :3], 2)
        rpy, half = np.rad2deg([self.camera.rpy, self.half[0, 3:]])
        turned = _with_half(("roll", "pitch", "yaw"), rpy, half, 3)
        seen = f"{where} mm in the {FRAMES[self.mounted][1]}"
        found = Sentence(f"{turned}°", "camera"), Sentence(seen, "target")
        apart = [*self.fit.apart]
        errors, numbers = self.fit.errors[apart], self.row[apart].tolist()
        wrong = [f"pair {k} is off by {_error(by)}; left out" for k, by in zip(numbers, errors, strict=True)]
        if len(apart) > MAX_LISTED:
            by = " to ".join(map(_error, (errors.min(0), errors.max(0))))
            wrong = [f"{len(apart)} of {len(self.row)} pairs are off by {by}; left out: {ranges(numbers)}"]
        if (errors[:, 1] > FLIPPED).any():
            wrong.append("half a turn: a chessboard's corners counted from its other end")
        return headed(self.sentence, *found, *lines("warning", wrong), notes=self.notes)

    def json(self) -> Json:
        both = zip(("camera", "target"), (self.camera, self.target), self.half, strict=True)
        found = {name: {"xyz": p.xyz, "rpy": p.rpy, "matrix": p.pose, "half_width": h} for name, p, h in both}
        scaled = np.vstack([self.fit.rms, self.fit.errors]) * [1e3, np.rad2deg(1.0)]
        rms, *pairs = [{"position_mm": position, "orientation_deg": angle} for position, angle in scaled]
        pairs = [{"pair": int(number), **each} for number, each in zip(self.row, pairs, strict=True)]
        head = {"mounted": self.mounted, "message": self.doubt or self.sentence, "residual_rms": rms}
        head["reading"] = f"camera {ON[self.mounted]}"
        more = {"pairs": pairs, "outliers": self.fit.apart, "notes": self.notes}
        return document("workbench.handeye/1", **head, reading_margin=self.margin, **found, **more)

    def save(self, path: Path | str) -> Path:
        """Write the camera as YAML of easy_handeye, as a joint of a URDF, or with the target as TOML."""
        ending = check_ending(path, "a camera's pose is", *ENDINGS).suffix.lower()
        if self.doubt:
            raise DataError(f"{self.doubt}; {path} is not written")
        xyz, rpy, tool = self.camera.xyz.tolist(), self.camera.rpy.tolist(), self.mounted is Mount.TOOL
        if ending == ".toml":
            target = {"xyz": self.target.xyz.tolist(), "rpy": self.target.rpy.tolist()}
            camera = {"mounted": str(self.mounted), "xyz": xyz, "rpy": rpy}
            return write_text(path, tomli_w.dumps({"camera": camera, "target": target}))
        if ending == ".urdf":
            return write_text(path, URDF.format(*xyz, *rpy, parent="tool0" if tool else "base_link"))
        xyzw = se3.matrix_to_quaternion(self.camera.rotation)[[1, 2, 3, 0]].tolist()
        return write_text(path, YAML.format(*xyz, *xyzw, kind="eye_in_hand" if tool else "eye_on_base"))


@checked_arguments()
def handeye(pairs: Path | Sequence[Path] | Sequence[Poses], *, mounted: Like[Mount] | None = None) -> HandEye:
    """Find a camera's pose, and that of the target it sees, from pairs of poses.

    Args:
        pairs: A file or a folder, or one for each side, the robot's first; or two arrays (rows, 4, 4): the
            hand in the base, and the target in the camera [m].
        mounted: What carries the camera, `tool` or `world`; None: as the pairs fit.

    Raises:
        FileError: the file holds no pairs.
        DataError: there are too few pairs, they are no poses, or they contradict `mounted`.
    """
    source, (is_told, is_inverting), rows, notes = "pairs", (True, False), None, list[str]()
    poses: Any = pairs
    if paths := [pairs] if isinstance(pairs, Path) else [path for path in pairs if isinstance(path, Path)]:
        source = " and ".join(map(str, paths))
        *poses, rows, is_told, is_inverting, notes = read_pairs(*paths)
    (robot, target), first = _checked(poses, source, notes)
    fits, part, shift = _paired(robot, target)
    for side, poses, factor in (("robot", robot, 1e-3), ("target", target, 1e3)):
        other = min(abs(fit.scale / factor - 1.0) for fit in fits.values())
        if (in_mm := IN_MM.format(side)) in notes and other < MAX_SCALE:
            notes.remove(in_mm)
            poses[:, :3, 3] *= 1e3
            fits, part, shift = _paired(robot, target)
    size = max(float(np.ptp(robot[:, :3, 3], axis=0).max()), pair_fit.MIN_SIZE)
    score = {m: float(fit.rms @ (1.0 / size, 1.0)) / fit.spare for m, fit in fits.items()}
    best = min(score, key=score.__getitem__)
    wanted = mounted or best
    if score[wanted] <= CLEARLY * score[best]:
        best = wanted
    elif not is_inverting:
        differ = f"{source}: with the camera {ON[wanted]} the pairs differ by {_error(fits[wanted].rms)}"
        agree = f"they agree to {_error(fits[best].rms)} with --mounted {best}"
        raise DataError(f"{differ}; {agree}, or if either side's poses are given as their inverses")
    if best is not wanted:
        notes.append("the robot's poses are those of the base in the hand, as easy_handeye writes them")
    elif not is_told:
        here, there = (", ".join(signed(v, 2) for v in 1e3 * p[:3, 3]) for p in fits[best].frames)
        elsewhere = ON[min(Mount, key=lambda mount: mount is best)]
        text = f"if the robot's are, the camera is {elsewhere} at {here} mm; if the target's, at {there} mm"
        notes.append(f"poses may be inverse: {text}; names such as base_T_hand tell")
    fit, row = fits[best], (first + 1 if rows is None else rows[first])[part]
    doubt = shift or _doubt(fit, robot, target, row)
    chance = np.sqrt(special.fdtri(fit.spare, fit.spare, 1.0 - pair_fit.CHANCE)) * score[best]
    if max(score.values()) < chance:
        both = f"{len(robot)} pairs fit a camera on the tool and in the cell alike"
        notes += [f"{both}: it is {ON[wanted]} as given"] * (mounted is not None)
        doubt = doubt or f"{both}: measure at more poses, or give --mounted" * (mounted is None)
    if fit.spread[12] and not doubt:
        notes.append(f"{_scale(fit)}, and are: if its size and focal length are right, divide these by it")
    margin = max(score.values()) / score[best]
    return HandEye(mounted=wanted, fit=fit, row=row, margin=margin, doubt=doubt, notes=tuple(notes))


def _checked(
    pairs: Sequence[Poses], source: str, notes: list[str]
) -> tuple[list[Poses], Int[np.ndarray, " rows"]]:
    """As many poses on both sides, in metres, their rotations exact, each robot pose once, and where each was
    first; adds what was decided to the notes."""
    sides = list[Poses]()
    for side, given in zip(("robot", "target"), pairs, strict=True):
        what = f"the {side}'s"
        poses = numbers(given, f"{what} poses").copy()
        if poses.ndim != 3 or poses.shape[1:] != (4, 4) or not np.isfinite(poses).all():
            raise DataError(f"{source}: {what} poses must be 4 × 4 matrices of finite numbers; {WANTED}")
        check_rotations(poses[:, :3, :3], f"{source}: {what} rotations")
        if np.abs(poses[:, :3, 3]).max(initial=0.0) > MAX_METRES:
            poses[:, :3, 3] *= 1e-3
            notes.append(IN_MM.format(side))
        sides.append(se3.pose(nearest_rotation(poses[:, :3, :3]), poses[:, :3, 3]))
    shots = Dataset(q=sides[0][:, :3].reshape(-1, 12))
    unit = pose_units(shots)
    if len(sides[0]) != len(sides[1]) or unit.max(initial=0) < 2:
        counts = repeats_text(shots) or f"{len(sides[0])} robot poses and {len(sides[1])} target poses"
        raise DataError(f"{source}: {counts}; give as many of both, at least 3, better 10")
    if text := repeats_text(shots):
        notes.append(f"{text}: they share its error, so that each pose is one pair")
    means = [np.array([side[unit == k].mean(0) for k in range(unit.max() + 1)]) for side in sides]
    sides = [se3.pose(nearest_rotation(mean[:, :3, :3]), mean[:, :3, 3]) for mean in means]
    return sides, np.unique(unit, return_index=True)[1]


def _with_half(names: Sequence[str], values: np.ndarray, half: np.ndarray, digits: int) -> str:
    """Numbers with their intervals."""
    rows = zip(names, values, half, strict=True)
    return ", ".join(f"{name} {signed(v, digits)} ± {h:.2g}" for name, v, h in rows)


def _error(error: Float[np.ndarray, "2"]) -> str:
    return f"{in_mm(error[0])}, {np.rad2deg(error[1]):.2g}°"


def _scale(fit: PairFit) -> str:
    what = "positions" if fit.along.all() else "depths (along the camera's z)"
    return f"the target's {what} fit if multiplied by {fit.scale:.4g} ± {fit.half[12]:.2g}"


def _fits(robot: Poses, target: Poses) -> dict[Mount, PairFit]:
    """With the camera on the hand, and in the cell."""
    return {Mount.TOOL: fit_pairs(robot, target), Mount.WORLD: fit_pairs(se3.inverse(robot), target)}


def _paired(robot: Poses, target: Poses) -> tuple[dict[Mount, PairFit], slice, str]:
    """Both fits of the pairs as given, or of each pose with the next one where only these agree; which of the
    target's poses have a pair, and that it is the next one's."""
    given, rows = _fits(robot, target), len(robot) - 1
    lost = min(map(_lost, given.values()))
    is_lost = lost > MAX_LOST and rows >= pair_fit.MIN_BOTH
    for where, k in (("before", 0), ("after", 1)) if is_lost else ():
        part = slice(1 - k, 1 - k + rows)
        fits = _fits(robot[k : k + rows], target[part])
        moved = min(fits.values(), key=_lost)
        if CLEARLY * _lost(moved) < lost:
            agree = f"the pairs agree to {_error(moved.rms)} with the robot's pose of the row {where}"
            return fits, part, f"{agree}, not with their own: shift the rows of one side by one"
    return given, slice(None), ""


def _lost(fit: PairFit) -> float:
    """Share of pairs that don't agree, others by how far they are from that."""
    return float(np.minimum((fit.errors / MAX_LEFT).max(1), 1.0).mean())


def _doubt(fit: PairFit, robot: Poses, target: Poses, row: Int[np.ndarray, " rows"]) -> str:
    """Why a camera's pose should not be used as it is; empty if it may be."""
    if fit.moved is not None:
        what, by, pair = fit.moved
        between = f"between pairs {row[fit.kept[fit.kept < pair][-1]]} and {row[pair]}"
        return f"the {what} moved by {_error(by)} {between}: give those before or after alone"
    if fit.scale < 0.0 and (fit.rms <= MAX_LEFT).all():
        why = "one side's axes are left-handed, as Unity's, or only its positions have the wrong sign"
        turn = "negate y of them, and qx and qz, or rx and rz, of its turns; or x, y and z of them alone"
        return _open(fit, robot) or f"{_scale(fit)}: {why}: {turn}"
    if abs(fit.scale - 1.0) > MAX_SCALE and fit.rms[1] <= MAX_LEFT[1] and fit.scale > fit.half[12]:
        cure = "the target's size, the focal length or the unit" if fit.along.all() else "the focal length"
        size = f"{_scale(fit)}: correct {cure}"
        return "; ".join(filter(None, [_open(fit, robot), size]))
    if (fit.rms > MAX_LEFT).any():
        differ = f"the pairs differ by {_error(fit.rms)}, whatever carries the camera"
        return f"{differ}: check which poses belong together, and the size of the target"
    apart = np.array([k for k in fit.apart if fit.errors[k, 1] < FLIPPED], int)
    if len(apart) >= pair_fit.MIN_PART:
        other = min(_fits(robot[apart], target[apart]).values(), key=_lost)
        if (other.rms < CLEARLY * fit.rms).all() and 2 * len(other.kept) > len(apart):
            which = f"pairs {ranges(row[apart[other.kept]].tolist())} agree among themselves"
            return f"{which} to {_error(other.rms)}: camera or target was moved; give them alone"
    if 2 * len(fit.kept) < len(row):
        return f"only {len(fit.kept)} of {len(row)} pairs agree: check which poses belong together"
    return _open(fit, robot)


def _open(fit: PairFit, robot: Poses) -> str:
    """That the pairs leave the camera's place open, and what to do; empty if they don't."""
    worst = fit.half[:6].reshape(2, 3).max(1)
    if (worst <= MAX_HALF).all():
        return ""
    hand = robot[:, :3, :3]
    turns = se3.matrix_to_rotvec(nearest_rotation(hand.sum(0)).T @ hand)
    _, extent, axes = np.linalg.svd(turns - turns.mean(0), full_matrices=False)
    known = f"the camera is known to ± {in_mm(worst[0])}, ± {np.rad2deg(worst[1]):.2g}° only: "
    if extent[0] < STILL * np.sqrt(len(turns)):
        kept = f"within {np.rad2deg(extent[0] / np.sqrt(len(turns))):.2g}°"
        return f"the camera's place is open: the hand kept one orientation ({kept}): turn it about two axes"
    if extent[1] > LITTLE * np.sqrt(len(turns)):
        return known + "add pairs, with the hand turned further between them"
    axis = int(np.abs(axes[0]).argmin())
    text = f"turn the hand more about its {'xyz'[axis]} axis (so far {np.rad2deg(turns[:, axis].std()):.2g}°)"
    return f"the camera's place is open in one direction: {text}"

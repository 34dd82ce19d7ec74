"""Hand–eye: where a camera is on the hand or in the cell, and the target it sees, from pairs of poses.

    A_i X B_i = Z

A is the hand in the base (for a camera in the cell, the base in the hand), B the target in the camera, X the
camera and Z the target. The closed form (`base/hand_eye.py`) begins Gauss–Newton on what is left of B, with
weights of positions and rotations from the fit itself. A pair is set apart where chance would leave so much
of it in one file of a hundred.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np
import tomli_w
from jaxtyping import Float
from scipy import special

from workbench.arm.frame import Frame
from workbench.base import se3
from workbench.base.arguments import checked_arguments
from workbench.base.array_checks import check_rotations, numbers
from workbench.base.errors import DataError
from workbench.base.files import check_ending, write_text
from workbench.base.hand_eye import base_and_tool, nearest_rotation
from workbench.base.wording import in_mm, plural
from workbench.data.dataset import Dataset
from workbench.data.postures import pose_units, repeats_text
from workbench.extras.camera.camera import ON, Mount
from workbench.extras.camera.pose_pairs import WANTED, Poses, read_pairs
from workbench.report.blocks import Block, Sentence, headed, lines
from workbench.report.json import Json, document
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown

ENDINGS = (".yaml", ".yml", ".urdf", ".toml")
"""Of files of a result."""
MAX_METRES = 20.0
"""Lengths are mm where one is larger."""
CHANCE, MAX_SHARE = 0.01, 0.25
"""Probability of setting a good pair apart in a file without bad ones; share of the pairs that may be."""
MAX_ROUNDS = 50
EQUAL, MIN_SIZE = 2.0, 0.05
"""Numbers that speak for positions as uncertain as angles times the hand's way; minimum of that way [m]."""
EXACT = 1e-7
"""Smallest standard deviation of positions [m] and rotations [rad]."""
MAX_HALF, MAX_LEFT = np.array([5e-3, 0.02]), np.array([0.02, 0.05])
"""Half intervals of the camera, and what the pairs leave, beyond which it should not be used [m, rad]."""
LITTLE = np.deg2rad(10.0)
"""A hand that turned by less about all axes but one (rms) leaves the camera's place along that one open."""
CLEARLY = 3.0
"""How many times better the pairs fit another mount than the one they contradict."""
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
        half: Half of the 95 % intervals of camera and target along their parents' axes [m, rad].
        errors: How far each pair's target is seen from where the result has it [m, rad].
        apart: Pairs that were set apart, the worst first.
        doubt: Why the result should not be used as it is; empty if it may be.
        notes: What else should be known, one sentence each.
    """

    mounted: Mount
    camera: Frame
    target: Frame
    half: Float[np.ndarray, "2 6"]
    errors: Float[np.ndarray, "rows 2"]
    apart: tuple[int, ...]
    doubt: str = ""
    notes: tuple[str, ...] = ()

    @property
    def left(self) -> Float[np.ndarray, "2"]:
        """Root mean square of the errors of the pairs that count [m, rad]."""
        return np.sqrt((np.delete(self.errors, self.apart, axis=0) ** 2).mean(0))

    @property
    def sentence(self) -> str:
        count = plural(len(self.errors) - len(self.apart), "pair")
        where = _with_half("xyz", 1e3 * self.camera.xyz, 1e3 * self.half[0, :3], 2)
        agree = f"{count} agree to {_error(self.left)}"
        return f"camera {ON[self.mounted]} at {where} mm in the {FRAMES[self.mounted][0]}; {agree}"

    def blocks(self) -> list[Block]:
        where = _with_half("xyz", 1e3 * self.target.xyz, 1e3 * self.half[1, :3], 2)
        rpy, half = np.rad2deg([self.camera.rpy, self.half[0, 3:]])
        turned = _with_half(("roll", "pitch", "yaw"), rpy, half, 3)
        seen = f"{where} mm in the {FRAMES[self.mounted][1]}"
        found = Sentence(f"{turned}°", "camera"), Sentence(seen, "target")
        wrong = (f"pair {k + 1} is off by {_error(self.errors[k])}; left out" for k in self.apart)
        return headed(self.sentence, *found, *lines("warning", wrong), notes=self.notes)

    def json(self) -> Json:
        both = zip(("camera", "target"), (self.camera, self.target), self.half, strict=True)
        found = {name: {"xyz": p.xyz, "rpy": p.rpy, "matrix": p.pose, "half_width": h} for name, p, h in both}
        scaled = np.vstack([self.left, self.errors]) * [1e3, np.rad2deg(1.0)]
        rms, *pairs = [{"position_mm": position, "orientation_deg": angle} for position, angle in scaled]
        head = {"mounted": self.mounted, "message": self.doubt or self.sentence, "residual_rms": rms}
        more = {"pairs": pairs, "outliers": self.apart, "notes": self.notes}
        return document("workbench.handeye/1", **head, **found, **more)

    def save(self, path: Path | str) -> Path:
        """Write the camera as YAML of easy_handeye, as a joint of a URDF, or with the target as TOML."""
        ending = check_ending(path, "a camera's pose is", *ENDINGS).suffix.lower()
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
def handeye(pairs: Path | Sequence[Poses], *, mounted: Mount | None = None) -> HandEye:
    """Find a camera's pose, and that of the target it sees, from pairs of poses.

    Args:
        pairs: A file, or two arrays (rows, 4, 4): the hand in the base, and the target in the camera [m].
        mounted: What carries the camera, `tool` or `world`; None: as the pairs fit.

    Raises:
        FileError: the file holds no pairs.
        DataError: there are too few pairs, they are no poses, or they contradict `mounted`.
    """
    source, told, inverting, given = "pairs", (True, True), False, tuple[str, ...]()
    if isinstance(pairs, Path):
        source = str(pairs)
        *pairs, told, inverting, given = read_pairs(pairs)
    (robot, target), notes = _checked(pairs, source, given)
    fits = {Mount.TOOL: _fit(robot, target), Mount.WORLD: _fit(se3.inverse(robot), target)}
    size = max(float(np.ptp(robot[:, :3, 3], axis=0).max()), MIN_SIZE)
    score = {mount: float(fit.left @ (1.0 / size, 1.0)) for mount, fit in fits.items()}
    best = min(score, key=score.__getitem__)
    wanted = mounted or best
    if score[wanted] <= CLEARLY * score[best]:
        best = wanted
    elif not inverting:
        raise DataError(
            f"{source}: with the camera {ON[wanted]} the pairs differ by {_error(fits[wanted].left)}; "
            f"they agree to {_error(fits[best].left)} with --mounted {best}, or if either the robot's or the "
            "target's poses are given as their inverses"
        )
    if best is not wanted:
        notes.append("the robot's poses are those of the base in the hand, as easy_handeye writes them")
        told = (True, told[1])
    doubt = _doubt(fits[best], robot[:, :3, :3])
    spare = 6 * (len(robot) - len(fits[best].apart)) - 12
    chance = np.sqrt(special.fdtri(spare, spare, 1.0 - CHANCE)) * score[best]
    if mounted is None and max(score.values()) < chance:
        both = f"{len(robot)} pairs fit a camera on the tool and in the cell alike"
        doubt = doubt or f"{both}: measure at more poses, or give --mounted"
    found = replace(fits[best], mounted=wanted, doubt=doubt)
    if not doubt:
        notes += _fit_alike(found, *told, mounted)
    return replace(found, notes=tuple(notes))


def _fit_alike(found: HandEye, robot_told: bool, target_told: bool, mounted: Mount | None) -> list[str]:
    """Where the camera is if poses whose direction isn't told are given as their inverses."""
    here, other = ON[found.mounted], next(ON[mount] for mount in Mount if mount is not found.mounted)
    camera, target = (", ".join(signed(1e3 * v, 1) for v in at.xyz) for at in (found.camera, found.target))
    ways = [] if target_told or mounted else [f"the target's, {other} at {target} mm"]
    ways += (
        [] if robot_told or mounted else [f"the robot's (easy_handeye, in the cell), {other} at {camera} mm"]
    )
    ways += [] if robot_told or target_told else [f"both, {here} at {target} mm"]
    text = "poses may be inverse, and the camera elsewhere: if {}; names such as base_T_hand tell"
    return [text.format("; if ".join(ways))] if ways else []


def _checked(pairs: Sequence[Poses], source: str, notes: Sequence[str]) -> tuple[list[np.ndarray], list[str]]:
    """As many poses on both sides, in metres, their rotations exact, each robot pose once; and what was
    decided."""
    notes, sides = [*notes], list[Poses]()
    for what, given in zip(("the robot's", "the target's"), pairs, strict=True):
        poses = numbers(given, f"{what} poses").copy()
        if poses.ndim != 3 or poses.shape[1:] != (4, 4) or not np.isfinite(poses).all():
            raise DataError(f"{source}: {what} poses must be 4 × 4 matrices of finite numbers; {WANTED}")
        check_rotations(poses[:, :3, :3], f"{source}: {what} rotations")
        if np.abs(poses[:, :3, 3]).max(initial=0.0) > MAX_METRES:
            poses[:, :3, 3] *= 1e-3
            notes.append(f"lengths of {what} poses are read as mm")
        sides.append(se3.pose(nearest_rotation(poses[:, :3, :3]), poses[:, :3, 3]))
    shots = Dataset(q=sides[0][:, :3].reshape(-1, 12))
    unit = pose_units(shots)
    if len(sides[0]) != len(sides[1]) or unit.max(initial=0) < 2:
        counts = repeats_text(shots) or f"{len(sides[0])} robot poses and {len(sides[1])} target poses"
        raise DataError(f"{source}: {counts}; give as many of both, at least 3, better 10")
    if text := repeats_text(shots):
        notes.append(f"{text}: they share its error, so that each pose is one pair")
    means = [np.array([side[unit == k].mean(0) for k in range(unit.max() + 1)]) for side in sides]
    return [se3.pose(nearest_rotation(mean[:, :3, :3]), mean[:, :3, 3]) for mean in means], notes


def _with_half(names: Sequence[str], values: np.ndarray, half: np.ndarray, digits: int) -> str:
    """Numbers with their intervals."""
    rows = zip(names, values, half, strict=True)
    return ", ".join(f"{name} {signed(v, digits)} ± {h:.2g}" for name, v, h in rows)


def _error(error: Float[np.ndarray, "2"]) -> str:
    return f"{in_mm(error[0])}, {np.rad2deg(error[1]):.2g}°"


def _doubt(fit: HandEye, hand: Float[np.ndarray, "rows 3 3"]) -> str:
    """Why a camera's pose should not be used as it is; empty if it may be."""
    if (fit.left > MAX_LEFT).any():
        differ = f"the pairs differ by {_error(fit.left)}, whatever carries the camera"
        return f"{differ}: check which poses belong together, and the size of the target"
    worst = fit.half[0].reshape(2, 3).max(1)
    if (worst <= MAX_HALF).all():
        return ""
    turns = se3.matrix_to_rotvec(nearest_rotation(hand.sum(0)).T @ hand)
    _, extent, axes = np.linalg.svd(turns - turns.mean(0), full_matrices=False)
    known = f"the camera is known to ± {in_mm(worst[0])}, ± {np.rad2deg(worst[1]):.2g}° only: "
    if extent[1] > LITTLE * np.sqrt(len(turns)):
        return known + "add pairs, with the hand turned further between them"
    axis = int(np.abs(axes[0]).argmin())
    turned = np.rad2deg(turns[:, axis].std())
    return known + f"turn the hand more about its {'xyz'[axis]} axis (so far {turned:.2g}°)"


def _fit(a: Poses, b: Poses) -> HandEye:
    """X and Z from the pairs that agree."""
    inverse_x, z = base_and_tool(se3.inverse(a), b)
    x, kept, apart = se3.inverse(inverse_x), np.arange(len(a)), list[int]()
    while True:
        x, z, sigma, residual, jacobian = _refined(a[kept], b[kept], x, z)
        u, s, vt = np.linalg.svd(jacobian, full_matrices=False)
        spare = residual.size - 12
        if len(apart) >= int(MAX_SHARE * len(a)) or spare < 18:
            break
        block, left = u.reshape(-1, 6, 12), residual.reshape(-1, 6)
        through = np.linalg.pinv(np.eye(6) - block @ np.swapaxes(block, 1, 2), rcond=1e-9)
        own = np.einsum("ri,rij,rj->r", left, through, left)  # what leaving the pair out would save
        rest = max(residual @ residual - own.max(), (spare - 6) * (EXACT / sigma.max()) ** 2)
        if special.fdtrc(6, spare - 6, own.max() / 6 / rest * (spare - 6)) * len(kept) > CHANCE:
            break
        apart.append(int(kept[own.argmax()]))
        kept = np.delete(kept, own.argmax())
    spread = np.sqrt(((vt / np.maximum(s, 1e-9 * s[0])[:, None]) ** 2).sum(0))
    return HandEye(
        mounted=Mount.TOOL,
        camera=Frame.from_pose(x),
        target=Frame.from_pose(z),
        half=(special.stdtrit(spare / 2, 0.975) * spread).reshape(2, 6),
        errors=np.linalg.norm(_linearised(a, b, x, z)[0].reshape(-1, 2, 3), axis=2),
        apart=tuple(apart),
    )


def _refined(a: Poses, b: Poses, x: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, ...]:
    """X and Z by Gauss–Newton; standard deviations [m, rad]; what is left and its derivative, whitened."""
    size = np.array([max(float(np.ptp(a[:, :3, 3], axis=0).max()), MIN_SIZE), 1.0])
    before, spare = np.zeros(2), 3 * len(a) - 6
    for _ in range(MAX_ROUNDS):
        left, jacobian = _linearised(a, b, x, z)
        squares = (left.reshape(-1, 2, 3) ** 2).sum((0, 2)) / size**2
        variance = (squares + EQUAL * squares.sum() / (2 * spare)) / (spare + EQUAL)
        sigma = np.maximum(size * np.sqrt(variance), EXACT)
        weight = np.repeat(1.0 / sigma, 3)
        left, jacobian = (left * weight).ravel(), (jacobian * weight[:, None]).reshape(-1, 12)
        step = np.linalg.lstsq(jacobian, left, rcond=1e-9)[0]
        if np.abs(step).max() < EXACT and np.allclose(sigma, before, rtol=1e-3):
            break
        x, z, before = _moved(x, step[:6]), _moved(z, step[6:]), sigma
    return x, z, sigma, left, jacobian


def _linearised(a: Poses, b: Poses, x: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """B as measured minus B̂ = X⁻¹ A⁻¹ Z [m, rad], and B̂'s derivative by X and Z along their parents' axes."""
    hand, to_camera = se3.inverse(a), x[:3, :3].T
    jacobian = np.zeros((len(a), 6, 12))
    jacobian[:, :3, :3] = jacobian[:, 3:, 3:6] = -to_camera
    jacobian[:, :3, 3:6] = to_camera @ se3.skew(se3.apply(hand, z[:3, 3]) - x[:3, 3])
    jacobian[:, :3, 6:9] = jacobian[:, 3:, 9:] = to_camera @ hand[:, :3, :3]
    return se3.pose_error(b, se3.inverse(x) @ hand @ z), jacobian


def _moved(pose: Float[np.ndarray, "4 4"], step: Float[np.ndarray, "6"]) -> Float[np.ndarray, "4 4"]:
    """A pose after a small step along and about its parent's axes [m, rad]."""
    return se3.pose(se3.rotvec_to_matrix(step[3:]) @ pose[:3, :3], pose[:3, 3] + step[:3])

"""Identify virtual arms from virtual pictures, and count where the answer is worse than promised.

    python tests/benchmarks/pictures.py --arms 3                               # a look
    python tests/benchmarks/pictures.py --arms 300 --json pictures.jsonl --check
    python tests/benchmarks/pictures.py --settings wrist,small-turn --arms 30

Everything that makes the pictures is here and shares nothing with the package: kinematics from DH constants
and turns of links, sag under weight, backlash, eccentric gears, boards and bodies before one or two cameras
projected by OpenCV, focal lengths that the files state 3 % wrong or not at all.

An answer is worse if its error exceeds the nominal arm's by more than 2 σ of the constants that it states.
Errors are those of the tool's place at poses within `NEAR` of the measured ones, in any orientation, after
the best base and tool frame. `wrist` arms have wrong wrist joints only, which turn the tool and hardly move
it; in `small-turn` the tool keeps its orientation to some degrees.
"""

import argparse
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS / "benchmarks")]

import cv2
import numpy as np
from ledger import Ledger
from scipy.spatial.transform import Rotation

import workbench as wb
from workbench.base.errors import WorkbenchError

H = np.pi / 2
DH = {
    "ur10": [
        (0, 0.1273, 0, H), (0, 0, -0.612, 0), (0, 0, -0.5723, 0),
        (0, 0.163941, 0, H), (0, 0.1157, 0, -H), (0, 0.0922, 0, 0),
    ],
    "irb": [
        (0, 0.486, 0.15, -H), (-H, 0, 0.475, 0), (0, 0, 0, -H),
        (0, 0.6, 0, H), (0, 0, 0, -H), (0, 0.065, 0, 0),
    ],
    "kuka": [
        (0, 0.4, 0.025, -H), (0, 0, 0.455, 0), (-H, 0, 0.035, -H),
        (0, 0.42, 0, H), (0, 0, 0, -H), (0, 0.08, 0, 0),
    ],
    "panda": [
        (0, 0.333, 0, -H), (0, 0, 0, H), (0, 0.316, 0.0825, H), (0, 0, -0.0825, -H),
        (0, 0.384, 0, H), (0, 0, 0.088, H), (0, 0.107, 0, 0),
    ],
    "small": [
        (0, 0.13, 0, H), (H, 0, 0.21, 0), (0, 0, 0.075, H),
        (0, 0.21, 0, -H), (0, 0, 0, H), (0, 0.07, 0, 0),
    ],
}  # fmt: skip
"""theta, d, a, alpha of every joint [rad, m], standard DH."""
PANDA = [(-2.5, 2.5), (-1.6, 1.6), (-2.5, 2.5), (-2.9, -0.3), (-2.5, 2.5), (0.2, 3.5), (-2.5, 2.5)]
LIMIT = 2.7
MADE = {
    "zeros": (0.3, 1e-4, 1e-4),
    "small": (0.02, 1e-4, 1e-4),
    "geometry": (0.1, 6e-4, 1e-3),
    "wrist": (0.0, 5e-5, 5e-5),
}
"""Standard deviations of zeros [°], lengths [m] and angles [rad] of a kind of arm; a wrist is off by 0.5°."""
BODY = 1e-3 * np.array(
    [(0, 0, 0), (50, 10, 20), (0, 60, -15), (45, 55, 30), (-40, 30, 10), (-20, -40, 35), (30, -50, -10),
     (10, 20, 60)]
)  # fmt: skip
ACROSS, DOWN, SQUARE = 7, 5, 0.03
SIZE, LENS = (1920, 1200), np.array([[1650.0, 0.0, 955.0], [0.0, 1653.0, 610.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.08, 0.05, 4e-4, -3e-4, 0.0])
CORNER = 0.2
"""Noise of corners [px]."""
NEAR, NEAR_POSES = 0.15, 2500
WORSE, THIRD = 2.0, 1.0 / 3.0
"""Standard errors by which an answer may be worse than nominal, and the part of nominal that zeros leave …"""
OFTEN = 0.9
"""… in so many arms."""
TRIES = 400


@dataclass(frozen=True)
class Setting:
    """What is before the camera, and what its file says.

    Args:
        free: As camera.toml says; None for no such file.
        board: A board, else a body of eight points.
        focal: How far off the focal length of the file may be.
        cameras: Number of them.
        few: Least and greatest number of points a picture shows.
        on_tool: Whether the camera rides on the tool.
        turn: How far the tool turns [°]; None: as it likes.
        kind: Of arms; "" for any of the first three.
        charuco: Whether the file gives a board as printed, to 0.2 %, and not as points that were measured.
    """

    free: str | None
    board: bool = True
    focal: float = 0.0
    cameras: int = 1
    few: tuple[int, int] | None = None
    on_tool: bool = False
    turn: float | None = None
    kind: str = ""
    pictures: int = 30
    charuco: bool = False


SETTINGS = {
    "board": Setting('"auto"'),
    "fixed": Setting("false", focal=0.03),
    "body": Setting('"auto"', board=False, focal=0.03, cameras=2, few=(3, 6)),
    "hand": Setting(None, on_tool=True),
    "few": Setting('"auto"', focal=0.03, pictures=12),
    "points": Setting("false", board=False, cameras=2, few=(1, 6)),
    "wrist": Setting('"auto"', kind="wrist", charuco=True),
    "wrist-hand": Setting('"auto"', on_tool=True, kind="wrist", charuco=True),
    "small-turn": Setting('"auto"', turn=12.0, charuco=True),
    "printed": Setting("false", focal=0.03, charuco=True),
}
USUAL = ("board", "fixed", "body", "hand")


def limits(name):
    return np.array(PANDA) if name == "panda" else np.tile([-LIMIT, LIMIT], (len(DH[name]), 1))


def pose(rotation=None, place=(0.0, 0.0, 0.0)):
    made = np.eye(4)
    made[:3, :3] = np.eye(3) if rotation is None else rotation
    made[:3, 3] = place
    return made


def inverse(poses):
    out, turned = np.zeros_like(poses), np.swapaxes(poses[..., :3, :3], -1, -2)
    out[..., :3, :3], out[..., 3, 3] = turned, 1.0
    out[..., :3, 3] = -(turned @ poses[..., :3, 3, None])[..., 0]
    return out


def turned(axes, angles):
    return Rotation.from_euler(axes, angles).as_matrix()


class Arm:
    """An arm as it is: constants, and what the package's model may lack."""

    def __init__(self, rng, name, kind):
        zeros, length, angle = MADE[kind]
        self.dh = np.array(DH[name], float)
        n = self.n = len(self.dh)
        for column, size in ((1, length), (2, length), (3, angle)):
            self.dh[:, column] += size * rng.normal(size=n)
        self.beta = angle * rng.normal(size=n) * (np.abs(np.sin(self.dh[:, 3])) < 1e-2)
        self.zeros = np.deg2rad(zeros) * rng.normal(size=n)
        if kind == "wrist":
            self.zeros[-3:-1] = np.deg2rad(0.5) * rng.choice([-1.0, 1.0], 2)
        self.soft = rng.uniform(0.3, 1.5, n) * 1e-5
        self.lash = rng.uniform(0.0, 2e-4, n)
        self.eccentric = np.c_[rng.uniform(0.0, 2e-4, n), rng.uniform(0.0, 6.28, n)]

    def chain(self, q):
        at = np.tile(np.eye(4), (len(q), 1, 1))
        found = [at]
        for k, (theta, d, a, alpha) in enumerate(self.dh):
            c, s, ca, sa = np.cos(q[:, k] + theta), np.sin(q[:, k] + theta), np.cos(alpha), np.sin(alpha)
            link = np.zeros((len(q), 4, 4))
            link[:, 0] = np.stack([c, -s * ca, s * sa, a * c], 1)
            link[:, 1] = np.stack([s, c * ca, -c * sa, a * s], 1)
            link[:, 2, 1:], link[:, 3, 3] = (sa, ca, d), 1.0
            at = at @ link @ pose(turned("y", self.beta[k]))
            found.append(at)
        return found

    def torques(self, q):
        frames, out = self.chain(q), np.zeros_like(q)
        middles = [0.5 * (a[:, :3, 3] + b[:, :3, 3]) for a, b in pairwise(frames)]
        for j in range(self.n):
            for k, mass in enumerate(np.linspace(4.0, 1.0, self.n)):
                if k >= j:
                    arm = middles[k] - frames[j][:, :3, 3]
                    out[:, j] += (np.cross(arm, [0.0, 0.0, -9.81 * mass]) * frames[j][:, :3, 2]).sum(1)
        return out

    def poses(self, q, direction):
        at = q + self.zeros + self.eccentric[:, 0] * np.sin(q + self.eccentric[:, 1])
        at = at + self.soft * self.torques(at)
        return self.chain(at + self.lash * direction)[-1]


def looking(eye, at, roll):
    z = np.subtract(at, eye)
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return pose(np.column_stack([x, np.cross(z, x), z]) @ turned("z", roll), eye)


def placed(rng, setting, reach, middle):
    """Poses of the cameras and of the target in what carries them."""
    if setting.on_tool:
        eyes = [
            pose(
                turned("xyz", rng.normal(0.0, 0.06, 3)) @ turned("z", rng.uniform(-3, 3)), (0.05, 0.03, 0.03)
            )
        ]
        flat = turned("xyz", [*rng.normal(0.0, 0.15, 2), rng.uniform(-3, 3)]) @ turned("x", np.pi)
        return eyes, pose(flat, (0.45 * reach, 0.1 * rng.normal(), 0.05)) @ pose(place=-middle)
    eyes = []
    for angle in (-0.5, 0.9)[: setting.cameras]:
        at = (0.45 * reach + 0.75 * reach * np.cos(angle), 0.75 * reach * np.sin(angle), 0.6 * reach)
        at = np.array(at) + 0.03 * rng.normal(size=3)
        eyes.append(looking(at, (0.45 * reach, 0.0, 0.4 * reach), rng.normal(0.0, 0.05)))
    held = turned("xyz", rng.normal(0.0, 0.2, 3)) @ turned("z", rng.uniform(-3, 3))
    return eyes, pose(held, np.array([0.02, 0.04, 0.06]) + 0.02 * rng.normal(size=3)) @ pose(place=-middle)


class Capture:
    """Pictures of an arm: joints, the tool's poses, and rows of picture, camera, point, u, v."""

    def __init__(self, rng, arm, name, setting):
        i, j = np.meshgrid(np.arange(1, ACROSS), np.arange(1, DOWN))
        grid = SQUARE * np.stack([i.ravel(), j.ravel(), 0 * i.ravel()], 1)
        self.points = grid if setting.board else BODY
        reach, bounds = np.abs(np.array(DH[name])[:, 1:3]).sum(), limits(name)
        eyes, target = placed(rng, setting, reach, self.points.mean(0))
        minimum = min(4, len(self.points))
        q, self.rows, truth = [], [], []
        for _ in range(TRIES if setting.turn else 61):
            if len(q) == setting.pictures:
                break
            drawn = rng.uniform(*bounds.T, (3000, len(bounds)))
            direction = np.sign(rng.normal(size=drawn.shape))
            if setting.turn and q:
                drawn = q[0] + np.deg2rad(0.5 * setting.turn) * rng.normal(size=drawn.shape)
            tool = arm.poses(drawn, direction)
            seen = [self._seen(eye, tool, target, setting, reach) for eye in eyes]
            sight = np.stack([ok for _, ok in seen], 1)
            shown = sight.sum(2) >= minimum
            good = (tool[:, 2, 3] > 0.02) & shown.any(1)
            wanted = setting.pictures - len(q)
            if setting.turn and q:
                between = Rotation.from_matrix(truth[0][:3, :3].T @ tool[:, :3, :3])
                good &= between.magnitude() < np.deg2rad(setting.turn)
            elif setting.turn:
                wanted = 1
            for row in np.flatnonzero(good)[:wanted]:
                for c in np.flatnonzero(shown[row]):
                    points = np.flatnonzero(sight[row, c])
                    if setting.few is not None:
                        count = rng.integers(setting.few[0], setting.few[1] + 1)
                        points = np.sort(rng.permutation(points)[:count])
                    for point in points:
                        at = seen[c][0][row, point] + CORNER * rng.normal(size=2)
                        self.rows.append((len(q), c, point, *at))
                q.append(drawn[row])
                truth.append(tool[row])
        if len(q) < setting.pictures:
            raise LookupError("too few poses show the target")
        self.q, self.truth = np.array(q), np.array(truth)

    def _seen(self, eye, tool, target, setting, reach):
        """Pixels of the points and which are in view, for each of the tool's poses."""
        at = inverse(tool @ eye) @ target if setting.on_tool else inverse(eye) @ (tool @ target)
        places = self.points @ np.swapaxes(at[:, :3, :3], 1, 2) + at[:, None, :3, 3]
        near = ((places[..., 2] > 0.15) & (places[..., 2] < 1.6 * reach)).all(1)
        places[~near] = 0.0, 0.0, 1.0
        uv, _ = cv2.projectPoints(places.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), LENS, DISTORTION)
        uv = uv.reshape(*places.shape[:2], 2)
        ok = ((uv > 8) & (uv < np.array(SIZE) - 8)).all(-1) & near[:, None]
        ok &= (np.abs(places[..., :2] / places[..., 2:]) < 0.75).all(-1)
        if setting.board:
            middle, normal = places.mean(1), at[:, :3, 2]
            slant = (normal * middle).sum(1) / np.linalg.norm(middle, axis=1)
            span = np.linalg.norm(uv.max(1) - uv.min(1), axis=1)
            ok &= ((slant > np.cos(np.deg2rad(65.0))) & (span > 120.0))[:, None]
        return uv, ok

    def write(self, folder, name, setting, focal):
        """The files of a session."""
        here, there = ("tool", "world") if setting.on_tool else ("world", "tool")
        rows = "".join(f"{i:03d},c{c},{p},{u:.3f},{v:.3f}\n" for i, c, p, u, v in self.rows)
        (folder / "pixels.csv").write_text(f"image,camera,id,u[px],v[px]\n{rows}")
        heads = ",".join(f"q{k + 1}[deg]" for k in range(self.q.shape[1]))
        rows = "".join(
            f"{i:03d},{','.join(f'{v:.5f}' for v in np.rad2deg(q))}\n" for i, q in enumerate(self.q)
        )
        (folder / "joints.csv").write_text(f"image,{heads}\n{rows}")
        if setting.free is not None:
            text = (
                f"size = {list(SIZE)}\nfx = {LENS[0, 0] * focal}\nfy = {LENS[1, 1] * focal}\n"
                f"cx = {LENS[0, 2]}\ncy = {LENS[1, 2]}\ndistortion = {DISTORTION.tolist()}\n"
                f'mounted = "{here}"\nfree = {setting.free}\n'
            )
            cameras = (f'[[camera]]\nname = "c{c}"\n{text}' for c in range(setting.cameras))
            (folder / "camera.toml").write_text("".join(cameras))
        points = "".join(f"[[point]]\nid = {k}\nxyz = {p.tolist()}\n" for k, p in enumerate(self.points))
        if setting.charuco:
            points = f"[charuco]\nsquares = [{ACROSS}, {DOWN}]\nsquare = {SQUARE}\nmarker = {0.75 * SQUARE}\n"
        (folder / "target.toml").write_text(f'mounted = "{there}"\n{points}')
        joints = "".join(
            f"[[joint]]\ntheta = {t!r}\nd = {d!r}\na = {a!r}\nalpha = {al!r}\nlimits = {bounds}\n"
            for (t, d, a, al), bounds in zip(np.array(DH[name]).tolist(), limits(name).tolist(), strict=True)
        )
        (folder / "robot.toml").write_text(f'name = "arm"\nconvention = "dh"\n{joints}')


def left_over(found, truth):
    """Root mean square error of the tool's place [mm] after the best base and tool."""
    tip = np.zeros(3)
    for _ in range(25):
        x, y = found[:, :3, 3] + found[:, :3, :3] @ tip, truth[:, :3, 3]
        u, _, vt = np.linalg.svd((y - y.mean(0)).T @ (x - x.mean(0)))
        base = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
        off = y - y.mean(0) - (x - x.mean(0)) @ base.T
        moved = base @ found[:, :3, :3]
        moved = (moved - moved.mean(0)).reshape(-1, 3)
        tip = tip + np.linalg.lstsq(moved, off.ravel(), rcond=1e-8)[0]
    return 1e3 * float(np.sqrt((off**2).sum(1).mean()))


def drawn(seed, title):
    """An arm and its pictures; None where the drawn camera sees too little nine times in a row."""
    setting = SETTINGS[title]
    for again in range(9):
        rng = np.random.default_rng([seed + 100_000 * again, list(SETTINGS).index(title), 77])
        name = list(DH)[rng.integers(len(DH))]
        kind = ["zeros", "zeros", "small", "geometry"][rng.integers(4)]
        kind = setting.kind or kind
        try:
            arm = Arm(rng, name, kind)
            focal = 1.0 + setting.focal * rng.choice([-1, 1]) if setting.focal else 1.0
            return rng, name, kind, arm, Capture(rng, arm, name, setting), focal
        except LookupError:
            continue
    return None


def one(seed, title):
    """What was identified, and what of it is right."""
    case = drawn(seed, title)
    if case is None:
        return {"error": "no poses"}
    rng, name, kind, arm, shots, focal = case
    record = {"arm": name, "kind": kind}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        shots.write(folder, name, SETTINGS[title], focal)
        began = time.perf_counter()
        try:
            robot = wb.load_robot(str(folder / "robot.toml"))
            camera = folder / "camera.toml"
            rig = wb.read_rig(camera if camera.exists() else None, folder / "target.toml")
            data = wb.read_pixels(folder / "pixels.csv", rig, joints=folder / "joints.csv", dof=robot.dof)
            run = wb.identify(robot, data, algorithms=("opt2",), seed=seed)
        except WorkbenchError as error:
            return record | {"error": str(error)}
    seconds = time.perf_counter() - began
    found = run.identifiability
    q = rng.uniform(*limits(name).T, (NEAR_POSES, robot.dof))
    truth = arm.poses(q, np.sign(rng.normal(size=q.shape)))
    distance = np.linalg.norm(truth[:, None, :3, 3] - shots.truth[None, :, :3, 3], axis=2).min(1)
    kept = distance < NEAR
    errors = [left_over(wb.tool_poses(r, q[kept]), truth[kept]) for r in (robot, run.robot)]
    return record | {
        "step": found.step.name,
        "nominal": errors[0],
        "calibrated": errors[1],
        "sigma": 1e3 * found.step.uncertainty,
        "expected": 1e3 * found.step.expected,
        "seconds": seconds,
        "doubts": list(found.doubts),
        "zeros": (run.robot.values(robot.joint_offsets) - robot.values(robot.joint_offsets)).tolist(),
    }


def is_worse(record):
    return record["calibrated"] - record["nominal"] > WORSE * record["sigma"]


def lines(records):
    """A line of numbers for every setting, and whether the promise holds."""
    kept = True
    print(f"{'setting':11} fits errors worse  zeros below a third  true/expected: median, 90 %, most  s")
    for title in dict.fromkeys(r["setting"] for r in records):
        every = [r for r in records if r["setting"] == title and r.get("error") != "no poses"]
        fits = [r for r in every if "error" not in r]
        worse = sum(map(is_worse, fits))
        zeros = [r["calibrated"] < THIRD * r["nominal"] for r in fits if r["kind"] == "zeros"]
        ratio = np.array([r["calibrated"] / r["expected"] for r in fits])
        quantiles = np.quantile(ratio, (0.5, 0.9, 1.0)) if fits else np.zeros(3)
        seconds = np.mean([r["seconds"] for r in fits]) if fits else 0.0
        print(
            f"{title:11} {len(fits):4} {len(every) - len(fits):6} {worse:5}  {sum(zeros):6} of {len(zeros):4}"
            f"          {quantiles[0]:.2f}, {quantiles[1]:.2f}, {quantiles[2]:.2f} {seconds:17.1f}"
        )
        kept &= not worse and (title not in USUAL or sum(zeros) >= OFTEN * len(zeros))
    return kept


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arms", type=int, default=3)
    parser.add_argument("--first", type=int, default=6000, help="seed of the first arm")
    parser.add_argument("--settings", default=",".join(USUAL), help=", ".join(SETTINGS))
    parser.add_argument("--json", type=Path, help="results; a run that was interrupted goes on from there")
    parser.add_argument("--check", action="store_true", help="exit status 1 where the promise is broken")
    given = parser.parse_args()
    ledger = Ledger(given.json)
    for seed in range(given.first, given.first + given.arms):
        for title in given.settings.split(","):
            if (key := f"{title} {seed}") not in ledger:
                ledger.add(key, {"setting": title} | one(seed, title))
    kept = lines(list(ledger.records.values()))
    raise SystemExit(int(given.check and not kept))


if __name__ == "__main__":
    main()

"""Virtual arms seen by cameras, independent of the package: own kinematics, own projection, own tags.

Dodecahedra of tags are carried by the tool before a camera in the cell; or the camera rides on the tool and
looks at them. Poses are drawn until enough is in view.
"""

from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from generator import VirtualArm, four, shift, turn
from round_trip import aligned

H = np.pi / 2
ARMS = {  # theta, d, a, alpha of every joint [rad, m]: standard DH, Rz(q + theta) Tz(d) Tx(a) Rx(alpha)
    "industrial": [(0, 0.45, 0.15, -H), (-H, 0, 0.59, 0), (0, 0, 0.13, -H), (0, 0.647, 0, H), (0, 0, 0, -H),
                   (0, 0.095, 0, 0)],
    "ur5": [(0, 0.089159, 0, H), (0, 0, -0.425, 0), (0, 0, -0.39225, 0), (0, 0.10915, 0, H),
            (0, 0.09465, 0, -H), (0, 0.0823, 0, 0)],
    "hobby": [(0, 0.17, 0.064, -H), (-H, 0, 0.305, 0), (0, 0, 0, -H), (0, 0.223, 0, H), (0, 0, 0, -H),
              (0, 0.036, 0, 0)],
    "7R": [(0, 0.34, 0, -H), (0, 0, 0, H), (0, 0.4, 0, H), (0, 0, 0, -H), (0, 0.4, 0, -H), (0, 0, 0, H),
           (0, 0.126, 0, 0)],
}  # fmt: skip
LIMIT = 2.6
K = np.array([1350.0, 1352.0, 810.0, 612.0])
SIZE = np.array([1600, 1200])
SOLID = 20  # ids from one solid's to the next one's


def look(eye, at):
    """Pose of a camera at `eye` that looks at `at`, its y axis downwards."""
    z = np.subtract(at, eye) / np.linalg.norm(np.subtract(at, eye))
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    return four(np.column_stack([x, np.cross(z, x), z]), eye)


def small(rng, angle, length):
    m = turn("x", angle * rng.normal()) @ turn("y", angle * rng.normal()) @ turn("z", angle * rng.normal())
    m[:3, 3] = length * rng.normal(size=3)
    return m


@dataclass(frozen=True, eq=False)
class Arm(VirtualArm):
    """An arm with errors of its constants, and what the package knows nothing of."""

    zeros: np.ndarray | float = 0.0
    compliance: np.ndarray | None = None
    backlash: np.ndarray | float = 0.0

    @property
    def dh(self):
        return self.table[:, :4]

    def poses(self, q, direction=0.0):
        q = q + self.zeros
        sag = 0.0 if self.compliance is None else self.compliance * self.moments(q)[..., 2]
        return self.pose(q - sag + self.backlash * direction)


def robot_toml(name):
    joints = "".join(
        f"[[joint]]\ntheta = {t!r}\nd = {d!r}\na = {a!r}\nalpha = {al!r}\nlimits = [-{LIMIT}, {LIMIT}]\n"
        for t, d, a, al in np.array(ARMS[name], float).tolist()
    )
    return f'name = "{name}"\nconvention = "dh"\n{joints}'


MIDDLE = np.deg2rad([0.0, 0.3, 0.3, 0.3, 0.3, 0.0])
"""Errors of zeros that no camera and target can take up."""


def made(seed, name, *, zeros=0.0, angle=0.0, length=0.0, **more):
    """Numbers, and an arm with errors of them: zeros and angles [rad], lengths [m], one standard deviation.

    A turn beta is an error of its own between parallel axes only, elsewhere another zero of the next joint.
    """
    dh, rng = np.array(ARMS[name], float), np.random.default_rng(seed)
    n = len(dh)
    off = np.column_stack([rng.normal(size=n) * s for s in (0.0, length, length, angle)])
    beta = angle * rng.normal(size=n) * (np.sin(dh[:, 3]) == 0.0)
    body = {"masses": np.full(n, 3.0), "coms": np.zeros((n, 3)), **more}
    return rng, Arm("dh", np.column_stack([dh + off, beta]), zeros=zeros * rng.normal(size=n), **body)


def dodecahedron():
    """Corners (tags, 4, 3) of square tags on eleven faces; the one below is the mount."""
    g = (1 + np.sqrt(5)) / 2
    normals = [(0, s, t * g) for s in (1, -1) for t in (1, -1)]
    normals = np.array([np.roll(n, k) for n in normals for k in range(3)], float)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals[normals[:, 2] > -0.9]
    tags = []
    for n in normals:
        x = np.cross(n, [0.3, 0.2, 0.93])
        x /= np.linalg.norm(x)
        y = np.cross(n, x)
        tags.append([0.09 * n + 0.0375 * (s * x + t * y) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return np.array(tags), normals


def pixels(points, k=K, distortion=(0, 0, 0, 0, 0)):
    k1, k2, p1, p2, k3 = distortion
    x, y = points[..., 0] / points[..., 2], points[..., 1] / points[..., 2]
    r = x**2 + y**2
    f = 1 + k1 * r + k2 * r**2 + k3 * r**3
    u = x * f + 2 * p1 * x * y + p2 * (r + 2 * x**2)
    v = y * f + p1 * (r + 2 * y**2) + 2 * p2 * x * y
    return np.stack([k[0] * u + k[2], k[1] * v + k[3]], -1)


@dataclass
class Scene:
    """Pixels of one arm: what a session writes into files."""

    q: np.ndarray
    rows: list
    truth: np.ndarray
    camera: np.ndarray
    targets: list
    session: list = field(default_factory=list)

    @property
    def target(self):
        return self.targets[0]

    def table(self):
        lines = ["image,camera,id,corner,u[px],v[px]"]
        lines += [f"{i},{c},{k},{j},{u:.4f},{v:.4f}" for i, c, k, j, u, v in self.rows]
        return "\n".join(lines) + "\n"

    def joints(self):
        head = ["image", *["session"] * bool(self.session)]
        head += [f"q{j + 1}[rad]" for j in range(self.q.shape[1])]
        rows = ([i, *self.session[i : i + 1], *self.q[i]] for i in range(len(self.q)))
        return "\n".join(",".join(map(str, row)) for row in (head, *rows)) + "\n"


def joined(**sessions):
    """Scenes of one arm as the sessions of one table; camera and targets are those of the first."""
    shots = list(sessions.values())
    begin = np.cumsum([0, *(len(s.q) for s in shots)]).tolist()
    rows = [(row[0] + first, *row[1:]) for first, s in zip(begin, shots, strict=False) for row in s.rows]
    names = [name for name, s in sessions.items() for _ in s.q]
    q, truth = (np.concatenate([getattr(s, k) for s in shots]) for k in ("q", "truth"))
    return replace(shots[0], q=q, truth=truth, rows=rows, session=names)


def scene(
    rng,
    arm,
    count,
    *,
    noise=0.3,
    on_tool=False,
    distortion=(0, 0, 0, 0, 0),
    k=K,
    eyes=None,
    scale=1.0,
    solids=1,
    cameras=None,
    targets=None,
):
    """Joints and pixels of `count` poses; `arm` is the actual one, tags stand in `target_toml`.

    Cameras and targets stand somewhere near the usual place, or where their poses are given.
    """
    tags, normals = dodecahedron()
    tags = tags * scale
    reach = np.abs(np.array(arm.dh)[:, 1:3]).sum()
    middle = np.array([0.5 * reach, 0.0, 0.45 * reach])
    eyes = eyes or [(middle + np.array([0.5 * reach + 0.4, -0.3 * reach, 0.2 * reach]))]
    if on_tool:
        eye = [shift([0.03, 0.05, 0.02]) @ turn("z", 0.3) @ turn("x", 0.1) @ small(rng, 0.05, 0.01)]
        body = [shift([0.55 * reach, 0.1 - 0.35 * k, 0.02]) @ small(rng, 0.2, 0.05) for k in range(solids)]
    else:
        eye = [look(at, middle) @ small(rng, 0.03, 0.02) for at in eyes]
        body = [shift([0.01, 0.02 + 0.26 * k, 0.13]) @ small(rng, 0.2, 0.01) for k in range(solids)]
    cameras = eye if cameras is None else cameras
    targets = body if targets is None else targets
    q, rows, truth = [], [], []
    while len(q) < count:
        batch = rng.uniform(-0.95 * LIMIT, 0.95 * LIMIT, (400, len(arm.dh)))
        direction = np.sign(rng.normal(size=batch.shape))
        for joints, _, tool in zip(batch, direction, arm.poses(batch, direction), strict=True):
            if tool[2, 3] < 0.05 or len(q) == count:
                continue
            seen = []
            for (c, eye), (b, target) in product(enumerate(cameras), enumerate(targets)):
                pose = np.linalg.inv(tool @ eye) @ target if on_tool else np.linalg.inv(eye) @ tool @ target
                points = tags @ pose[:3, :3].T + pose[:3, 3]
                centre = points.mean(1)
                facing = -((normals @ pose[:3, :3].T) * centre).sum(1) / np.linalg.norm(centre, axis=1)
                if (centre[:, 2] < 0.25).any():
                    continue
                uv = pixels(points, k, distortion)
                inside = ((uv > 5) & (uv < SIZE - 5)).all((1, 2)) & (facing > 0.45)
                seen += [
                    (len(q), f"c{c}", int(t) + SOLID * b, j, *(uv[t, j] + noise * rng.normal(size=2)))
                    for t in np.flatnonzero(inside)
                    for j in range(4)
                ]
            if len(seen) >= 12:
                q.append(joints)
                rows += seen
                truth.append(tool)
    return Scene(np.array(q), rows, np.array(truth), np.array(cameras), targets)


def camera_toml(count=1, *, mounted="world", free="false", k=K, distortion=(0, 0, 0, 0, 0)):
    return "".join(
        f'[[camera]]\nname = "c{c}"\nsize = [{SIZE[0]}, {SIZE[1]}]\nfx = {k[0]}\nfy = {k[1]}\ncx = {k[2]}\n'
        f'cy = {k[3]}\ndistortion = {list(map(float, distortion))}\nmounted = "{mounted}"\nfree = {free}\n'
        for c in range(count)
    )


def target_toml(mounted="tool", solids=1):
    tags, _ = dodecahedron()
    board, point = ("board", "board.point") if solids > 1 else ("", "point")
    text = f'mounted = "{mounted}"\n'
    for b in range(solids):
        text += f'[[{board}]]\nname = "{"ABC"[b]}"\n' if board else ""
        text += "".join(
            f"[[{point}]]\nid = {k + SOLID * b}\ncorner = {j}\nxyz = {tags[k, j].tolist()}\n"
            for k in range(len(tags))
            for j in range(4)
        )
    return text


def rigid_error(found, truth):
    """Root mean square distance [m] of tool points after the best frames before and after the arm."""
    right = np.zeros(3)
    for _ in range(15):
        p = (found[:, :3, :3] @ right) + found[:, :3, 3]
        left = aligned(p, truth[:, :3, 3])
        off = truth[:, :3, 3] - (p @ left[:3, :3].T + left[:3, 3])
        turned = (left[:3, :3] @ found[:, :3, :3]).reshape(-1, 3)
        right = right + 0.5 * np.linalg.lstsq(turned, off.ravel(), rcond=None)[0]
    return float(np.sqrt((off**2).sum(1).mean()))

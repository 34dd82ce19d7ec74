"""Virtual arms and measurements that share no code with the package: plain numpy, one link at a time.

Conventions, with each joint's row of the table (theta, d, a, alpha, beta):

    hayati, dh   A = Rz(q+theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)
    craig        A = Rx(alpha) Ry(beta) Tx(a) Rz(q+theta) Tz(d)

A sliding joint adds q to d instead. An arm may also bend: `deflection` turns every joint by a small rotation
vector right before its driven rotation (in the axes there), which imitates compliance, backlash and tilting
that a geometric model does not declare.
"""

import tomllib
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

PARALLEL = 1e-3
NAMES = ("theta", "d", "a", "alpha", "beta")
I3, I4 = np.eye(3), np.eye(4)


def turn(axis, angle):
    """4×4 rotation matrices about one coordinate axis, for an array of angles."""
    angle = np.asarray(angle, float)
    c, s = np.cos(angle), np.sin(angle)
    m = np.zeros((*angle.shape, 4, 4))
    m[...] = I4
    i, j = ((1, 2), (2, 0), (0, 1))["xyz".index(axis)]
    m[..., i, i] = m[..., j, j] = c
    m[..., i, j], m[..., j, i] = -s, s
    return m


def move(axis, length):
    """4×4 translations along one coordinate axis, for an array of lengths."""
    length = np.asarray(length, float)
    m = np.zeros((*length.shape, 4, 4))
    m[...] = I4
    m[..., "xyz".index(axis), 3] = length
    return m


def shift(vector):
    """A 4×4 translation."""
    m = I4.copy()
    m[:3, 3] = vector
    return m


def rotation(vector):
    """Rodrigues' formula for an array of rotation vectors."""
    vector = np.asarray(vector, float)
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vector, -1, 0)
    o = np.zeros_like(x)
    k = np.stack([np.stack(r, -1) for r in ((o, -z, y), (z, o, -x), (-y, x, o))], -2)  # [v]x
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return I3 + first * k + second * (k @ k)


def four(r, place=(0.0, 0.0, 0.0)):
    """Rotation matrices, and places of their origins, as 4×4 transforms."""
    r, place = np.asarray(r, float), np.asarray(place, float)
    m = np.zeros((*np.broadcast_shapes(r.shape[:-2], place.shape[:-1]), 4, 4))
    m[..., :3, :3], m[..., :3, 3], m[..., 3, 3] = r, place, 1.0
    return m


@dataclass(frozen=True, eq=False)
class VirtualArm:
    """A serial arm from a table of Denavit–Hartenberg constants.

    Args:
        convention: `hayati`, `dh` or `craig`.
        table: One row (theta, d, a, alpha, beta) per joint [rad, m].
        base: Pose of the arm's first frame in the measuring frame.
        tool: Pose of the tool in the arm's last frame.
        limits: Least and greatest coordinate per joint, for `random`.
        slides: Whether each joint is prismatic.
        masses: Per link [kg].
        coms: Centre of mass of each link in its link frame [m].
        gravity: In the arm's first frame [m/s²].
    """

    convention: str
    table: np.ndarray
    base: np.ndarray = field(default_factory=lambda: I4)
    tool: np.ndarray = field(default_factory=lambda: I4)
    limits: np.ndarray | None = None
    slides: tuple[bool, ...] | None = None
    masses: np.ndarray | None = None
    coms: np.ndarray | None = None
    gravity: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))

    def __post_init__(self):
        assert self.convention in ("hayati", "dh", "craig")
        assert self.table.ndim == 2
        assert self.table.shape[1] == 5

    @property
    def dof(self):
        """Number of joints."""
        return len(self.table)

    @property
    def sliding(self):
        """Mask of prismatic joints."""
        return np.array(self.slides or (False,) * self.dof)

    @property
    def parallel(self):
        """Per joint: whether its constants lie between two nominally parallel revolute axes."""
        straight = np.abs(np.sin(self.table[:, 3])) < PARALLEL
        ends = np.zeros(self.dof, bool)
        ends[0 if self.convention == "craig" else -1] = True
        other = np.roll(self.sliding, 1 if self.convention == "craig" else -1)
        return straight & ~ends & ~self.sliding & ~other

    def parts(self, q):
        """Per joint: transforms (rows, 4, 4) before, of, and after the driven element."""
        for i, (theta, d, a, alpha, beta) in enumerate(self.table):
            slide = self.sliding[i]
            tilt = turn("x", alpha) @ turn("y", beta)
            rotate, shift = turn("z", theta), move("z", d)
            driven = move("z", q[:, i]) if slide else turn("z", q[:, i])
            if self.convention == "craig":
                before, after = tilt @ move("x", a), shift
                yield (before @ rotate, driven, after) if slide else (before, driven @ rotate, after)
            else:
                after = move("x", a) @ tilt
                yield (rotate, driven @ shift, after) if slide else (I4, driven @ rotate @ shift, after)

    def pose(self, q, deflection=None):
        """Tool poses (rows, 4, 4); `deflection` (rows, joints, 3) as `bent` has it."""
        return self.base @ self.bent(self.parts(np.atleast_2d(q)), deflection)[1][-1] @ self.tool

    def touching(self, place, q):
        """Joint positions (1, joints) near the given ones at which the tool's point is at a place, if any."""
        for _ in range(80):
            points = self.pose(q + np.concatenate([np.zeros((1, self.dof)), 1e-6 * np.eye(self.dof)]))[
                :, :3, 3
            ]
            if np.linalg.norm(points[0] - place) < 1e-13:
                break
            slope = (points[1:] - points[0]).T / 1e-6
            q = q + np.linalg.lstsq(slope, place - points[0], rcond=1e-3)[0]
        return q

    def straight(self, q):
        """What `bent` has of the arm that nothing bends."""
        return self.bent(self.parts(q))

    def bent(self, parts, bend=None):
        """Transforms (joints, rows, 4, 4) to right before each drive, and to each link, first frame.

        Joints turn by rotation vectors (rows, joints, 3) right before their drives, in the axes there; the
        third number of a sliding joint shifts it.
        """
        here, before, links = I4, [], []
        for i, (fixed, driven, after) in enumerate(parts):
            before.append(here := here @ fixed)
            if bend is not None:
                slides = self.sliding[i]
                tilt, slid = bend[:, i] * [1.0, 1.0, not slides], bend[:, i, 2] * slides
                here = here @ four(rotation(tilt)) @ move("z", slid)
            links.append(here := here @ driven @ after)
        return np.array(np.broadcast_arrays(*before)), np.array(np.broadcast_arrays(*links))

    def moments(self, q, payload=0.0, wrench=None):
        """Moments (rows, joints, 3) that hold the straight arm at rest, as `holding` has them."""
        q = np.atleast_2d(q)
        return self.holding(*self.straight(q), np.broadcast_to(payload, len(q)), wrench)

    def holding(self, before, links, payload, wrench=None):
        """Moments (rows, joints, 3) that hold the later links against weight, about each drive, its axes.

        The third one of a sliding joint is the force along it. Every link's weight acts at its centre of
        mass, payload and wrench [f; τ] at the tool.

        Args:
            before, links: Transforms as of `straight`.
        """
        outside = np.zeros((len(payload), 6)) if wrench is None else wrench
        places = np.einsum("jrab,jb->jra", links[:, :, :3, :3], self.coms) + links[:, :, :3, 3]
        tool = links[-1, :, :3, :3] @ self.tool[:3, 3] + links[-1, :, :3, 3]
        pull = self.masses[:, None, None] * self.gravity * np.ones_like(places)
        pull, places = (
            np.concatenate([pull, (payload[:, None] * self.gravity + outside[:, :3])[None]]),
            np.concatenate([places, tool[None]]),
        )
        turning = np.cross(places, pull)
        out = []
        for i, frame in enumerate(before):
            weight, moment = pull[i:].sum(0), turning[i:].sum(0)
            load = moment + outside[:, 3:] - np.cross(frame[:, :3, 3], weight)
            held = -np.einsum("rba,rb->ra", frame[:, :3, :3], load)
            if self.sliding[i]:
                held[:, 2] = -np.einsum("rb,rb->r", frame[:, :3, 2], weight + outside[:, :3])
            out.append(held)
        return np.stack(out, 1)

    def sag(self, q, *, compliance=0.0, backlash=0.0, payload=0.0):
        """Deflections (rows, joints, 3) under the arm's own weight: joints give way to the load.

        Args:
            q: Joint angles that the encoders show [rad].
            compliance: Angle per moment, a number or (joints, 3) [rad/(N m)].
            backlash: Angle towards the sign of the load, a number or (joints, 3) [rad].
            payload: Mass at the tool [kg].

        Moments are taken at the encoders' angles: deflections of milliradians change them by as little.
        """
        load = -self.moments(q, payload)
        return compliance * load + backlash * np.sign(load)

    def proper(self):
        """Mask of the table's constants that are identifiable: four a joint, beta for d where parallel."""
        mask = np.ones(self.table.shape, bool)
        mask[self.parallel, 1] = False
        mask[~self.parallel, 4] = False
        return mask

    def perturbed(self, rng, length=5e-3, angle=np.pi / 36):
        """The arm as made: uniform errors (5 mm, 5°) on the four proper constants of every joint."""
        reach = np.array([angle, length, length, angle, angle])
        errors = rng.uniform(-1.0, 1.0, self.table.shape) * reach * self.proper()
        return replace(self, table=self.table + errors)

    def random(self, rng, rows):
        """Joint coordinates (rows, joints), uniform within the limits."""
        limits = np.tile([-np.pi, np.pi], (self.dof, 1)) if self.limits is None else self.limits
        return rng.uniform(limits[:, 0], limits[:, 1], (rows, self.dof))

    def measure(self, q, rng, sigma_p=0.0, sigma_r=0.0, deflection=None):
        """Positions (rows, 3) and rotations (rows, 3, 3) with normal noise per axis [m, rad]."""
        pose = self.pose(q, deflection)
        p = pose[:, :3, 3] + sigma_p * rng.standard_normal((len(pose), 3))
        r = rotation(sigma_r * rng.standard_normal((len(pose), 3))) @ pose[:, :3, :3]
        return p, r

    def toml(self, name="virtual", free="false"):
        """The arm as a robot file of the formats page, numbers exactly; `free` is that of base and tool."""
        lines = [f'name = "{name}"', f'convention = "{self.convention}"', f"gravity = {_list(self.gravity)}"]
        for i, row in enumerate(self.table):
            lines.append("[[joint]]")
            lines += [f"{k} = {float(v)!r}" for k, v in zip(NAMES, row, strict=True)]
            if self.sliding[i]:
                lines.append('type = "prismatic"')
            if self.limits is not None:
                lines.append(f"limits = {_list(self.limits[i])}")
            if self.masses is not None:
                lines += [f"mass = {float(self.masses[i])!r}", f"com = {_list(self.coms[i])}"]
        for owner, pose in (("base", self.base), ("tool", self.tool)):
            r = pose[:3, :3]
            rpy = (
                np.arctan2(r[2, 1], r[2, 2]),
                np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0])),
                np.arctan2(r[1, 0], r[0, 0]),
            )
            lines += [f"[{owner}]", f"xyz = {_list(pose[:3, 3])}", f"rpy = {_list(rpy)}", f"free = {free}"]
        return "\n".join(lines) + "\n"


def _list(numbers):
    return "[" + ", ".join(repr(float(v)) for v in numbers) + "]"


def _table(*rows):
    return np.array(rows, float)


def columns(d, a, alpha, theta=0.0):
    """The table of an arm from lengths and quarter turns by joint."""
    return np.stack(np.broadcast_arrays(theta, d, a, alpha, 0.0), axis=1) * [QUARTER, 1, 1, QUARTER, 1]


QUARTER = np.pi / 2
TURN = 2 * np.pi
ARIA_LIMITS = _table(
    (-TURN, TURN), (-0.97, 3.615), (-TURN, 1.69), (-TURN, TURN), (-np.pi, np.pi), (-TURN, TURN)
)
ARIA_MASSES = np.array([2.6, 2.3, 1.6, 1.2, 1.0, 0.6])
ARIA_COMS = _table((0, -0.05, 0), (-0.2, 0, 0.06), (-0.02, 0, 0.03), (0, 0.1, 0), (0, 0, 0.02), (0, 0, -0.08))


def aria():
    """Nominal ARIA (its Table 1), with assumed masses."""
    d, a = (0.205, 0, -0.0048, 0.336, -0.049, 0.202), (0, 0.41, 0.03, 0, 0, 0)
    table = columns(d, a, (1, 0, 1, -1, 1, 0), theta=(0, 0, 1, 0, 0, 0))
    return VirtualArm("hayati", table, limits=ARIA_LIMITS, masses=ARIA_MASSES, coms=ARIA_COMS)


def aria_as_printed(number):
    """The virtual arm of ARIA's Table 3, or the real one of Table 4, as printed; starred entries are 0."""
    printed = Path(__file__).with_name("studies") / "aria_printed.toml"
    rows = tomllib.loads(printed.read_text(encoding="utf-8"))[f"table_{number}"]
    return replace(aria(), table=_table(*([float(cell or 0.0) for cell in row] for row in rows)))


def three_parallel():
    """A 6R arm with three parallel axes, after the Universal Robots UR5."""
    d, a = (0.089159, 0, 0, 0.10915, 0.09465, 0.0823), (0, -0.425, -0.39225, 0, 0, 0)
    table = columns(d, a, (1, 0, 0, 1, -1, 0))
    x, y = (0, 0.21, 0.15, 0, 0, 0), (-0.026, 0, 0, -0.002, 0.002, 0)
    coms = np.stack([x, y, (0.002, 0.113, 0.027, 0.016, 0.016, 0)], axis=1)
    return VirtualArm("dh", table, masses=np.array([3.7, 8.4, 2.3, 1.2, 1.2, 0.2]), coms=coms)


def katana():
    """A 5R arm after the Katana 450 (thesis, Table 4.1); its last fixed link is the tool."""
    table = columns((0, 0, 0, 0, 0.1473), (0, 0, 0.19, 0.139, 0), (0, 1, 0, 0, -1))
    return VirtualArm(
        "craig",
        table,
        shift([0.055, 0.055, 0.2015]),
        turn("x", QUARTER) @ move("z", 0.2),
        limits=np.deg2rad(_table((-169.5, 169.5), (-30, 102), (-122.5, 122.5), (-112, 112), (-168, 168))),
        masses=np.array([1.2, 1.03, 0.9, 1.0, 0.8]),
        coms=_table((0, 0, -0.06), (0.1, 0, 0), (0.104, 0, 0), (0, 0.08, 0), (0, -0.07, 0)),
    )


def seven():
    """A redundant 7R arm after the KUKA iiwa 14."""
    table = columns((0.36, 0, 0.42, 0, 0.4, 0, 0.126), 0.0, (-1, 1, 1, -1, -1, 1, 0))
    limits = np.deg2rad(np.array([170, 120, 170, 120, 170, 120, 175]))[:, None] * [-1, 1]
    coms = np.tile([0.0, 0.03, 0.05], (7, 1))
    return VirtualArm(
        "dh", table, limits=limits, masses=np.array([4.0, 4.0, 3.0, 2.7, 1.7, 1.8, 0.3]), coms=coms
    )


ARMS = {
    "aria": aria,
    "aria-table3": partial(aria_as_printed, 3),
    "aria-table4": partial(aria_as_printed, 4),
    "three-parallel": three_parallel,
    "katana": katana,
    "seven": seven,
}

"""Virtual arms on a lift, in plain numpy: what was not known of a real campaign, and what is true of it.

The carriage tips under the moment that it carries, by a compliance and a play that grow with the lift's
extension; the joints behind it are soft. The base stands off level and turns slowly, in the room and against
gravity; inclinometers on base and carriage read both. The file knows nothing of this, and lacks one mass.
"""

from dataclasses import dataclass

import numpy as np
from generator import rotation, turn

H = np.pi / 2
NOMINAL = np.array([  # theta, d, a, alpha (standard DH); the first joint slides
    [0.0, 0.30, 0.00, 0.0], [0.0, 0.25, 0.00, H], [0.0, 0.00, 0.45, 0.0], [0.0, 0.00, 0.40, 0.0],
    [0.0, 0.12, 0.00, H], [0.0, 0.10, 0.00, -H], [0.0, 0.09, 0.00, 0.0],
])  # fmt: skip
MASS = np.array([9.0, 6.5, 8.0, 4.5, 2.0, 1.8, 0.8])
COM = np.array([
    [0.0, 0.02, -0.05], [0.0, -0.03, 0.02], [-0.22, 0.0, 0.1], [-0.2, 0.0, 0.04], [0.0, 0.01, 0.02],
    [0.0, -0.01, 0.02], [0.0, 0.0, -0.03],
])  # fmt: skip
TOOL = np.array([0.03, 0.02, 0.12])
LIFT = (0.0, 0.5)
LOST = 3
"""The joint, from 1, whose link has no mass in the file."""
HOUR = 3600.0


@dataclass(frozen=True)
class Truth:
    """What one arm hides.

    Args:
        geometry: DH table.
        soft: Compliance of the turning joints [rad/(N m)].
        tipping: Compliance of the carriage, and its growth [rad/(N m), 1/m of extension].
        play: Tilt of the carriage by its play, and its growth [rad, rad/m].
        level: Rotation of the base against a level room.
        turning: Of the base [rad/s], axes of the room.
        scale: What joint 4 turns too little.
    """

    geometry: np.ndarray
    soft: np.ndarray
    tipping: tuple[float, float]
    play: tuple[float, float]
    level: np.ndarray
    turning: np.ndarray
    scale: float


def about(axis, angle):
    return turn(axis, angle)[:3, :3]


def draw(rng, *, scale=0.0, off_level=0.01, play=1.0, drift=0.04e-3):
    spread = np.array([1e-3, 5e-4, 5e-4, 1e-3])
    geometry = NOMINAL + rng.normal(0.0, 1.0, NOMINAL.shape) * spread
    geometry[0, 0] = 0.0
    heading = rng.uniform(0, 2 * np.pi)
    tilt = off_level * np.array([np.cos(heading), np.sin(heading), 0.0])
    other = rng.uniform(0, 2 * np.pi)
    return Truth(
        geometry,
        np.array([0, 2e-5, 3e-5, 4e-5, 6e-5, 6e-5, 8e-5]) * rng.uniform(0.5, 1.5, 7),
        (1e-5 * rng.uniform(0.5, 1.5), 8e-5 * rng.uniform(0.6, 1.4)),
        (0.0, play * 6e-4 * rng.uniform(0.6, 1.4)),
        rotation(tilt),
        drift / HOUR * np.array([np.cos(other), np.sin(other), 0.0]),
        scale,
    )


def frames(truth, q, bend, tip):
    """Frames after each joint, and the point and axes before each drive, from the base's own frame."""
    r, p = np.eye(3), np.zeros(3)
    after, before = [], []
    for k, (theta, d, a, alpha) in enumerate(truth.geometry):
        before.append((r, p))
        if k == 0:
            p = p + r @ [0, 0, d + q[0]]
            carriage = (r, p)
            r = r @ about("x", tip[0]) @ about("y", tip[1])
            r = r @ about("z", theta)
        else:
            turned = q[k] * (1.0 - truth.scale * (k == 3)) + theta + bend[k]
            r = r @ about("z", turned)
            p = p + r @ [0, 0, d]
        p = p + r @ [a, 0, 0]
        r = r @ about("x", alpha)
        after.append((r, p))
    return after, before, carriage


def stand(truth, q, down):
    """The arm as it hangs: frames after each joint, by its own fixed point."""
    bend, tip = np.zeros(7), np.zeros(2)
    for _ in range(12):
        after, before, carriage = frames(truth, q, bend, tip)
        centres = np.array([r @ c + p for (r, p), c in zip(after, COM, strict=True)])
        lifts = -np.outer(MASS, down)
        for k in range(1, 7):
            r, p = before[k]
            moment = np.cross(centres[k:] - p, lifts[k:]).sum(0)
            bend[k] = -truth.soft[k] * (moment @ r[:, 2])
        r, p = carriage
        moment = r.T @ np.cross(centres - p, lifts).sum(0)
        soft = truth.tipping[0] + truth.tipping[1] * q[0]
        loose = truth.play[0] + truth.play[1] * q[0]
        tip = -soft * moment[:2] - loose * moment[:2] / np.linalg.norm(moment[:2])
    return frames(truth, q, bend, tip)[0]


def reading(rotation_to_level):
    x, y, z = rotation_to_level[2]
    return np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))


def measure(truth, rng, rows=120, hours=2.0, noise=5e-5, tilt_noise=2e-5):
    """Columns of a table, by heading."""
    low = np.array([LIFT[0], *[-2.2] * 6])
    high = np.array([LIFT[1], *[2.2] * 6])
    q = rng.uniform(low, high, (rows, 7))
    time = np.linspace(0.0, hours * HOUR, rows)
    place, facing = np.array([1.2, -0.8, 0.1]), about("z", 0.7)
    position, base, lift = np.empty((rows, 3)), np.empty((rows, 2)), np.empty((rows, 2))
    for i in range(rows):
        standing = rotation(truth.turning * time[i]) @ truth.level @ facing
        after = stand(truth, q[i], standing.T @ [0, 0, -9.81])
        r, p = after[-1]
        position[i] = standing @ (r @ TOOL + p) + place
        base[i] = reading(standing)
        lift[i] = reading(standing @ after[0][0])
    position += rng.normal(0.0, noise, position.shape)
    base, lift = (t + rng.normal(0.0, tilt_noise, t.shape) for t in (base, lift))
    columns = {f"q{k + 1}[{'m' if k == 0 else 'rad'}]": q[:, k] for k in range(7)}
    columns |= {f"{c}[m]": position[:, k] for k, c in enumerate("xyz")} | {"time[s]": time}
    for link, t in ((0, base), (1, lift)):
        columns |= {f"tilt_{c}{link}[rad]": t[:, k] for k, c in enumerate("xy")}
    return columns


def file(lost=LOST, masses=True):
    """The robot's file: nominal geometry, masses without that of one link."""
    out = ['name = "lift"', 'convention = "dh"']
    for k, (theta, d, a, alpha) in enumerate(NOMINAL.tolist()):
        out += ["[[joint]]", f"theta = {theta}", f"d = {d}", f"a = {a}", f"alpha = {alpha}"]
        out += ['type = "prismatic"', f"limits = {list(LIFT)}"] if k == 0 else ["limits = [-2.8, 2.8]"]
        if masses and k + 1 != lost:
            out += [f"mass = {MASS[k]}", f"com = {COM[k].tolist()}"]
    return "\n".join([*out, "[base]", "free = true", "[tool]", "free = true"])


def table(columns):
    rows = np.column_stack(list(columns.values()))
    return "\n".join([",".join(columns), *(",".join(repr(float(v)) for v in row) for row in rows)])

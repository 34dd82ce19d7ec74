"""Virtual arms on a lift, in plain numpy: what was not known of a real campaign, and what is true of it.

The carriage tips under the moment that it carries, by a compliance and a play that grow with the lift's
extension; the joints behind it are soft. The base stands off level and turns slowly, in the room and against
gravity; inclinometers on base and carriage read both. The file knows nothing of this, and lacks one mass.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from generator import VirtualArm, rotation
from laws import pieces
from round_trip import write_table

from workbench import Dataset, Robot, load_robot, read_measurements

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


def arm_of(geometry, **more):
    table, slides = np.column_stack([geometry, np.zeros(7)]), (True, *[False] * 6)
    return VirtualArm("dh", table, slides=slides, masses=MASS, coms=COM, **more)


def reading(turned):
    """Of an inclinometer, from orientations in a level room."""
    x, y, z = np.moveaxis(turned[:, 2], -1, 0)
    return np.stack([np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))], 1)


def measure(truth, rng, rows=120, hours=2.0, noise=5e-5, tilt_noise=2e-5):
    """Columns of a table, by heading; the arm hangs at its own fixed point, tipping where the lift ends."""
    q = rng.uniform([LIFT[0], *[-2.2] * 6], [LIFT[1], *[2.2] * 6], (rows, 7))
    time = np.linspace(0.0, hours * HOUR, rows)
    standing = rotation(np.outer(time, truth.turning)) @ truth.level @ rotation([0.0, 0.0, 0.7])
    arm = arm_of(truth.geometry, gravity=np.swapaxes(standing, 1, 2) @ [0.0, 0.0, -9.81])
    joints = pieces(arm, q * (1.0 - truth.scale * (np.arange(7) == 3)), np.ones(rows))
    bend, (soft, loose) = np.zeros((rows, 7, 3)), ((a + b * q[:, :1]) for a, b in (truth.tipping, truth.play))
    for _ in range(12):
        before, links = arm.bent(joints, bend)
        held = arm.holding(before, links, np.zeros(rows))
        bend[:, 1:, 2] = -truth.soft[1:] * held[:, 1:, 2]
        weight = MASS[0] * np.einsum("rba,rb->ra", links[0, :, :3, :3], arm.gravity)  # of the carriage itself
        across = held[:, 1, :2] - np.cross(COM[0], weight)[:, :2]
        bend[:, 1, :2] = -soft * across - loose * across / np.linalg.norm(across, axis=1, keepdims=True)
    links = arm.bent(joints, bend)[1]
    flange, carriage = links[-1], links[0, :, :3, :3] @ rotation(bend[:, 1] * [1.0, 1.0, 0.0])
    position = (standing @ (flange[:, :3, :3] @ TOOL + flange[:, :3, 3])[..., None])[..., 0] + [
        1.2,
        -0.8,
        0.1,
    ]
    position += rng.normal(0.0, noise, position.shape)
    base, lift = (
        reading(turned) + rng.normal(0.0, tilt_noise, (rows, 2)) for turned in (standing, standing @ carriage)
    )
    columns = {f"q{k + 1}[{'m' if k == 0 else 'rad'}]": q[:, k] for k in range(7)}
    columns |= {f"{c}[m]": position[:, k] for k, c in enumerate("xyz")} | {"time[s]": time}
    for link, t in ((0, base), (1, lift)):
        columns |= {f"tilt_{c}{link}[rad]": t[:, k] for k, c in enumerate("xy")}
    return columns


def files(folder, columns, lost=LOST, masses=True) -> tuple[Robot, Dataset]:
    """Nominal geometry, masses without that of one link, and rows, through files."""
    arm = arm_of(NOMINAL, limits=np.array([LIFT, *[(-2.8, 2.8)] * 6]))
    gone = (
        r"mass = .*\ncom = .*\n" if not masses else rf"mass = {MASS[lost - 1]}\ncom = .*\n" if lost else "^$"
    )
    paths = Path(folder) / "robot.toml", Path(folder) / "rows.csv"
    paths[0].write_text(re.sub(gone, "", arm.toml("lift", free="true")))
    write_table(paths[1], columns, np.column_stack(list(columns.values())))
    return load_robot(paths[0]), read_measurements(paths[1])

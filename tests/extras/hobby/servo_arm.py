"""An arm of the SO-101's size in MuJoCo: motors that count, hold softly and scatter, a board on the gripper.

Kinematics and statics are MuJoCo's; of the package nothing is used. Joints give way under gravity like
springs about where their motors hold them.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from generator import four, rotation

ROBOT = Path(__file__).parents[3] / "assets" / "robots" / "so101.toml"
NAMES = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
MASSES = (0.13, 0.13, 0.13, 0.13, 0.2)
"""Of the links [kg], each halfway to the next joint, the gripper 50 mm ahead."""
SOFT = 40.0
"""Stiffness of a joint [N m/rad]: the tip sags by 5 mm on average."""
PART = 0.8
"""Of the joint limits that poses use."""


def _quat(axis, angle):
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * np.array(axis)])


def _product(a, b):
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, a, b)
    return out


def _model():
    rows = tomllib.loads(ROBOT.read_text())["joint"]
    spec = mujoco.MjSpec()
    body, limits = spec.worldbody, []
    for k, row in enumerate(rows):
        if row.get("type") != "fixed":
            limits.append(row["limits"])
            body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        theta, a, d = row["theta"], row["a"], row["d"]
        place = [a * np.cos(theta), a * np.sin(theta), d]
        if row.get("type") != "fixed":
            n = len(limits) - 1
            at = np.array(place) / 2 if n < 4 else [0, 0, 0.05]
            body.mass, body.ipos, body.inertia = MASSES[n], at, [1e-4] * 3
            body.explicitinertial = True
        turn = _product(_quat([0, 0, 1], theta), _quat([1, 0, 0], row["alpha"]))
        body = body.add_body(pos=place, quat=turn) if k < len(rows) - 1 else body
    body.add_site(name="tool", pos=place, quat=turn)
    return spec.compile(), np.array(limits)


MODEL, LIMITS = _model()


def poses(q, *, stiffness=np.inf):
    """Gripper poses in the arm's base where motors hold the joints at q."""
    data, out = mujoco.MjData(MODEL), []
    for row in q:
        at = row.copy()
        for _ in range(25 if np.isfinite(stiffness) else 1):
            data.qpos[:] = at
            mujoco.mj_forward(MODEL, data)
            at = row - data.qfrc_bias / stiffness
        site = data.site("tool")
        out.append(four(site.xmat.reshape(3, 3), site.xpos))
    return np.array(out)


@dataclass
class ServoArm:
    """One arm and how its motors were put in.

    Args:
        seed: Of all that chance decides.
        zero: The motors' zeros are off by half to one and a half of this, either way [rad].
        stiffness: Of the joints [N m/rad].
        scatter: Standard deviation of a joint about what its motor reads [rad].
        signs: Of the motors; drawn if None.
    """

    seed: int
    zero: float = np.deg2rad(12.0)
    stiffness: float = SOFT
    scatter: float = 0.0
    signs: np.ndarray = None

    def __post_init__(self):
        rng = np.random.default_rng([self.seed, 1])
        self.signs = rng.choice([-1.0, 1.0], 5) if self.signs is None else self.signs
        self.offsets = self.zero * rng.choice([-1.0, 1.0], 5) * rng.uniform(0.5, 1.5, 5)
        self.base = four(rotation(rng.normal(size=3)), rng.normal(0.0, 0.4, 3))
        self.end = four(rotation(rng.normal(size=3)), rng.normal(0.0, 0.04, 3))

    def drawn(self, count, seed):
        """Joint positions."""
        low, high = PART * LIMITS.T
        return np.random.default_rng([self.seed, seed]).uniform(low, high, (count, 5))

    def counts(self, q):
        """What the motors read, 4096 to a turn, joint position 0 near 2048."""
        return np.round(2048 + self.signs * (q - self.offsets) * 4096 / (2 * np.pi)).astype(int)

    def board(self, q, *, rng=None):
        """Poses of the board in the camera; noise of a camera (0.5 mm, 0.1°) and scatter if rng is given."""
        if rng is None:
            return self.base @ poses(q, stiffness=self.stiffness) @ self.end
        q = q + rng.normal(0.0, self.scatter, q.shape)
        out = self.base @ poses(q, stiffness=self.stiffness) @ self.end
        out[:, :3, 3] += rng.normal(0.0, 5e-4, (len(q), 3))
        out[:, :3, :3] = rotation(rng.normal(0.0, np.deg2rad(0.1), (len(q), 3))) @ out[:, :3, :3]
        return out

    def measured(self, count=20, run=2):
        """Counts and board poses of one recording; motors hold within 1° of where they are sent."""
        q = self.drawn(count, run)
        return self.counts(q), self.board(q, rng=np.random.default_rng([self.seed, run, 5]))

    def angles(self, counts):
        """Motors' angles from 2048 [rad]."""
        return (counts - 2048) * 2 * np.pi / 4096

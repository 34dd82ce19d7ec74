"""The task that every package solves, with numpy alone: one arm, its measured poses, errors, timing.

The arm is ARIA with a tool, in the modified DH constants (Craig)

    T = base · Π Rot(x, α_i) Rot(y, β_i) Trans(x, a_i) Rot(z, q_i + θ_i) Trans(z, d_i) · tool

which every package can build. Two actual arms are hidden: `plain` has errors that all four models can
represent; in `tilted` the parallel axes 2 and 3 are tilted about y as well (β), as in any arm that was made,
which four constants a joint can't follow. Nothing here is the code of a package under test.
"""

import json
import statistics
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from generator import VirtualArm, four, rotation
from generator import turn as about

ARMS = ("plain", "tilted")
JOINTS = 6
SIGMA_POSITION = 1e-4  # m
SIGMA_ROTATION = np.deg2rad(0.02)
LENGTH_ERROR = 2e-3  # m, even
ANGLE_ERROR = np.deg2rad(0.5)  # even
HALF_PI = np.pi / 2
# alpha, a, theta, d of each joint
NOMINAL = np.array([
    [0, 0, 0, 0.205], [HALF_PI, 0, 0, 0], [0, 0.41, HALF_PI, -0.0048], [HALF_PI, 0.03, 0, 0.336],
    [-HALF_PI, 0, 0, -0.049], [HALF_PI, 0, 0, 0.202],
])  # fmt: skip
TOOL = np.array([0.03, -0.02, 0.10])  # m, orientation of the flange
LIMITS = np.array([[-3.0, 3.0], [-0.97, 3.6], [-3.0, 1.69], [-3.0, 3.0], [-3.0, 3.0], [-3.0, 3.0]])


def arm(constants, beta, **frames):
    """The arm of these constants."""
    alpha, a, theta, d = constants.T
    return VirtualArm("craig", np.column_stack([theta, d, a, alpha, beta]), **frames)


def make(seed, train, held_out):
    """Arrays of the task: joint rows, measured poses, and noise-free held-out poses of both arms."""
    rng = np.random.default_rng(seed)
    spread = np.array([ANGLE_ERROR, LENGTH_ERROR, ANGLE_ERROR, LENGTH_ERROR])
    constants = NOMINAL + rng.uniform(-1, 1, NOMINAL.shape) * spread
    base, tool = (
        four(rotation(rng.uniform(-1, 1, 3) * ANGLE_ERROR), rng.uniform(-1, 1, 3) * LENGTH_ERROR)
        for _ in range(2)
    )
    tool = four(np.eye(3), TOOL) @ tool
    tilt = np.zeros(JOINTS)
    tilt[2] = ANGLE_ERROR
    q = rng.uniform(LIMITS[:, 0], LIMITS[:, 1], (train + held_out, JOINTS))
    arrays = {"q": q[:train], "q_held_out": q[train:]}
    for name, beta in zip(ARMS, (np.zeros(JOINTS), tilt), strict=True):
        actual = arm(constants, beta, base=base, tool=tool).pose(q)
        turned = rotation(rng.normal(0, SIGMA_ROTATION, (train, 3))) @ actual[:train, :3, :3]
        noise = rng.normal(0, SIGMA_POSITION, (train, 3))
        arrays[name] = four(turned, actual[:train, :3, 3] + noise)
        arrays[f"{name}_held_out"] = actual[train:]
    return arrays


def urdf():
    """The nominal arm as a URDF: joints turn about z after Rot(x, α) Trans(x, a) Rot(z, θ) Trans(z, d)."""
    lines = ['<robot name="aria">', '<link name="base_link"/>']
    parent = "base_link"
    for i, (alpha, a, theta, d) in enumerate(NOMINAL, 1):
        place = np.array([a, 0, 0]) + about("x", alpha)[:3, :3] @ [0, 0, d]
        # Rot(x, α) Rot(z, θ) as roll, pitch, yaw: α = ±90° turns yaw into pitch
        turn = (about("x", alpha) @ about("z", theta))[:3, :3]
        pitch = np.arcsin(np.clip(-turn[2, 0], -1, 1))
        roll, yaw = np.arctan2(turn[2, 1], turn[2, 2]), np.arctan2(turn[1, 0], turn[0, 0])
        if abs(abs(turn[2, 0]) - 1) < 1e-12:
            roll, yaw = 0.0, np.arctan2(-turn[0, 1], turn[1, 1])
        lines.append(
            f'<joint name="joint{i}" type="revolute"><parent link="{parent}"/><child link="link{i}"/>'
            f'<origin xyz="{place[0]!s} {place[1]!s} {place[2]!s}" rpy="{roll!s} {pitch!s} {yaw!s}"/>'
            '<axis xyz="0 0 1"/><limit lower="-3.2" upper="3.7" effort="100" velocity="3"/></joint>'
            f'<link name="link{i}"/>'
        )
        parent = f"link{i}"
    lines.append(
        f'<joint name="tool_joint" type="fixed"><parent link="{parent}"/><child link="tool"/>'
        f'<origin xyz="{TOOL[0]!s} {TOOL[1]!s} {TOOL[2]!s}" rpy="0 0 0"/></joint><link name="tool"/></robot>'
    )
    return "\n".join(lines)


def errors(predicted, actual):
    """Mean distance [mm] and mean rotation [deg] between poses."""
    predicted, actual = np.asarray(predicted, float), np.asarray(actual, float)
    distance = np.linalg.norm(predicted[:, :3, 3] - actual[:, :3, 3], axis=1)
    trace = np.einsum("rij,rij->r", predicted[:, :3, :3], actual[:, :3, :3])
    frobenius = np.sqrt(np.maximum(6.0 - 2.0 * trace, 0.0))  # = 2√2 sin(angle / 2)
    angle = 2.0 * np.arcsin(np.clip(frobenius / (2.0 * np.sqrt(2.0)), 0, 1))
    return 1e3 * float(distance.mean()), float(np.rad2deg(angle).mean())


def repeat(work, count, prepare=lambda: None):
    """Seconds of each of some calls after one that is not counted, and the last answer."""
    seconds = []
    for _ in range(count + 1):
        given = prepare()
        began = time.perf_counter()
        answer = work() if given is None else work(given)
        seconds.append(time.perf_counter() - began)
    return seconds[1:], answer


def path(name, how, parameters, arms, rotation=True):
    """One way of identifying, for the report; `arms` holds seconds and held-out predictions by arm."""
    return {"name": name, "how": how, "parameters": parameters, "rotation": rotation, "arms": arms}


def rate(name, how, rows, seconds):
    """One way of computing poses with identification Jacobians, for the report."""
    return {"name": name, "how": how, "poses_per_second": rows / statistics.median(seconds)}


def worker(body):
    """Run a worker: `body(arrays, folder, repeats)` gives a report, printed as one line of JSON."""
    folder, repeats = Path(sys.argv[1]), int(sys.argv[2])
    arrays = dict(np.load(folder / "task.npz"))
    printed, sys.stdout = sys.stdout, sys.stderr  # what the packages print is no part of the report
    report = body(arrays, folder, repeats)
    report["versions"] = {"python": sys.version.split()[0], "numpy": np.__version__}
    print(json.dumps(report), file=printed, flush=True)

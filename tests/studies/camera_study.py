"""How honest a camera's results are: many virtual arms, their zeros, hand–eye and errors against the truth.

    python tests/studies/camera_study.py ARM KIND DRAWS [PICTURES]

KIND is `zeros` (0.3° zero errors alone), `nominal` (an industrial arm's 0.2 mm), `shift` (that, one joint off
by up to 1°) or `effects` (that, with joints that give way and backlash). Printed are the parts of zeros and
of camera and target coordinates inside their 95 % intervals, true errors at poses that were not measured, and
how often the result is worse than the nominal arm.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import camera_arms as virtual

import workbench as wb

NORMAL = 1.96


def actual(rng, name, kind):
    """A virtual arm of a kind, and the joint that was shifted."""
    n = len(virtual.ARMS[name])
    if kind == "zeros":
        arm = virtual.made(rng, name, zeros=np.deg2rad(0.3))
        arm.zeros[[0, -1]] = 0.0  # told from camera and target by nothing
        return arm, None
    off = {"angle": 1.2e-4, "length": 0.8e-4, "zeros": 1.5e-4}
    if kind == "effects":
        gives = 1e-5 * rng.uniform(0.5, 1.5, n)
        return virtual.made(rng, name, **off, compliance=gives, backlash=rng.uniform(0.0, 3e-4, n)), None
    arm = virtual.made(rng, name, **off)
    if kind == "nominal":
        return arm, None
    joint = int(rng.integers(1, n - 1))
    arm.zeros[joint] += np.deg2rad(rng.uniform(0.2, 1.0)) * rng.choice([-1, 1])
    return arm, joint


def draw(seed, name, kind, pictures, *, on_tool=False):
    """One virtual arm: normalised errors of zeros and of camera and target, true errors [mm]."""
    rng = np.random.default_rng(seed)
    arm, joint = actual(rng, name, kind)
    shots = virtual.scene(rng, arm, pictures, on_tool=on_tool)
    folder = Path(tempfile.mkdtemp())
    mounts = ("tool", "world") if on_tool else ("world", "tool")
    files = {
        "pixels.csv": shots.table(),
        "joints.csv": shots.joints(),
        "camera.toml": virtual.camera_toml(mounted=mounts[0]),
        "target.toml": virtual.target_toml(mounts[1]),
        "robot.toml": virtual.Arm(np.array(virtual.ARMS[name], float)).toml(name),
    }
    for file, text in files.items():
        (folder / file).write_text(text)
    robot = wb.load_robot(str(folder / "robot.toml"))
    rig = wb.read_rig(folder / "camera.toml", folder / "target.toml")
    data = wb.read_pixels(folder / "pixels.csv", rig, joints=folder / "joints.csv", dof=robot.dof)
    run = wb.identify(robot, data, algorithms=("opt2",), seed=seed)
    fit = run.best.fit
    place = {n: k for k, n in enumerate(fit.problem.names)}
    zeros = {
        int(n[5:-6]) - 1: (fit.x[k] - fit.parameters[k].nominal - arm.zeros[int(n[5:-6]) - 1]) / fit.std[k]
        for n, k in place.items()
        if n.endswith(".theta")
    }
    frames = []
    for owner, pose in (("camera[c0]", shots.camera[0]), ("target", shots.target)):
        frames += [
            (fit.x[place[f"{owner}.{a}"]] - pose[i, 3]) / fit.std[place[f"{owner}.{a}"]]
            for i, a in enumerate("xyz")
        ]
    q = rng.uniform(-0.9 * virtual.LIMIT, 0.9 * virtual.LIMIT, (4000, robot.dof))
    way = np.sign(rng.normal(size=q.shape))
    truth = arm.poses(q, way)
    near = np.linalg.norm(truth[:, None, :3, 3] - shots.truth[None, :, :3, 3], axis=2).min(1) < 0.15
    q, truth = q[near], truth[near]
    errors = [1e3 * virtual.rigid_error(wb.tool_poses(r, q), truth) for r in (robot, run.robot)]
    return run, zeros, frames, errors, joint


def main():
    name, kind, draws = sys.argv[1], sys.argv[2], int(sys.argv[3])
    pictures = int(sys.argv[4]) if len(sys.argv) > 4 else 60
    zeros, frames, errors, expected, steps, shifted = [], [], [], [], [], []
    for seed in range(draws):
        run, z, f, e, joint = draw(seed, name, kind, pictures)
        zeros += list(z.values())
        frames += f
        errors.append(e)
        expected.append(1e3 * run.gate.step.expected)
        steps.append(run.gate.step.name)
        if joint is not None:
            shifted.append(z.get(joint, np.inf))
    e = np.array(errors)
    inside = [
        f"{100 * np.mean(np.abs(v) < NORMAL):.1f} %" if len(v) else "–" for v in (zeros, frames, shifted)
    ]
    print(f"{name} {kind}: {draws} arms, {pictures} pictures")
    print(f"  inside 95 %: zeros {inside[0]}, camera and target {inside[1]}, shifted joint {inside[2]}")
    print(
        f"  true error nominal {e[:, 0].mean():.3f}, result {e[:, 1].mean():.3f} mm (max {e[:, 1].max():.3f})"
    )
    worse = int((e[:, 1] > e[:, 0] + 0.005).sum())
    print(f"  expected {np.mean(expected):.3f} mm; worse than nominal in {worse}")
    print("  steps", {s: steps.count(s) for s in sorted(set(steps))}, flush=True)


if __name__ == "__main__":
    main()

"""How honest a camera's results are: many virtual arms, their zeros, hand–eye and errors against the truth.

    python tests/studies/camera_study.py ARM KIND FIRST:LAST [PICTURES] [--json FILE]
    python tests/studies/camera_study.py ARM KIND FIRST:LAST [PICTURES] --splits COUNT [--json FILE]
    python tests/studies/camera_study.py --show FILE …

KIND is `zeros` (0.3° zero errors alone), `nominal` (an industrial arm's 0.2 mm), `shift` (that, one joint
off by up to 1°) or `effects` (that, with joints that give way and backlash). `--splits` fits four fifths of
each arm's pictures that many times and judges on the true poses of the rest. Printed are the parts of zeros,
and of camera's and target's coordinates, inside their 95 % intervals, true errors at poses that were not
measured, and how often the result is worse than the nominal arm. `--json` gathers a line a draw, so that runs
can be divided. `--solids 2`: two solids of tags whose poses to one another nobody knows; `--on-tool`: the
camera rides on the tool.
"""

import argparse
import json
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import camera_arms as virtual

import workbench as wb
from workbench.base import se3

NORMAL = 1.96


def actual(rng, name, kind):
    """A virtual arm of a kind, and the joint that was shifted.

    The first and the last zero are right: camera and target are told in base and tool, which they set.
    """
    n = len(virtual.ARMS[name])
    joint = None
    if kind == "zeros":
        arm = virtual.made(rng, name, zeros=np.deg2rad(0.3))
    else:
        more = {}
        if kind == "effects":
            more["compliance"] = 1e-5 * rng.uniform(0.5, 1.5, n)
            more["backlash"] = rng.uniform(0.0, 3e-4, n)
        arm = virtual.made(rng, name, angle=1.2e-4, length=0.8e-4, zeros=1.5e-4, **more)
        if kind == "shift":
            joint = int(rng.integers(1, n - 1))
            arm.zeros[joint] += np.deg2rad(rng.uniform(0.2, 1.0)) * rng.choice([-1, 1])
    arm.zeros[[0, -1]] = 0.0
    return arm, joint


def measured(shots, name, *, on_tool=False, solids=1):
    """The nominal arm, and the data of a session read from its files."""
    folder = Path(tempfile.mkdtemp())
    mounts = ("tool", "world") if on_tool else ("world", "tool")
    files = {
        "pixels.csv": shots.table(),
        "joints.csv": shots.joints(),
        "camera.toml": virtual.camera_toml(mounted=mounts[0]),
        "target.toml": virtual.target_toml(mounts[1], solids),
        "robot.toml": virtual.Arm(np.array(virtual.ARMS[name], float)).toml(name),
    }
    for file, text in files.items():
        (folder / file).write_text(text)
    robot = wb.load_robot(str(folder / "robot.toml"))
    rig = wb.read_rig(folder / "camera.toml", folder / "target.toml")
    return robot, wb.read_pixels(folder / "pixels.csv", rig, joints=folder / "joints.csv", dof=robot.dof)


def normalised(fit, shots, arm):
    """Errors of zeros by joint, and of camera and target, in standard errors."""
    place = {n: k for k, n in enumerate(fit.problem.names)}
    zeros = {
        int(n[5:-6]) - 1: (fit.x[k] - fit.parameters[k].nominal - arm.zeros[int(n[5:-6]) - 1]) / fit.std[k]
        for n, k in place.items()
        if n.endswith(".theta")
    }
    frames = []
    names = ("target[A]", "target[B]") if len(shots.targets) > 1 else ("target",)
    for owner, pose in (("camera[c0]", shots.camera[0]), *zip(names, shots.targets, strict=True)):
        at = [place[f"{owner}.{part}"] for part in ("x", "y", "z", "rx", "ry", "rz")]
        turned = se3.matrix_to_rotvec(pose[:3, :3] @ se3.rotvec_to_matrix(fit.x[at[3:]]).T)
        turned = se3.left_jacobian_inverse(fit.x[at[3:]]) @ turned
        frames += (np.concatenate([fit.x[at[:3]] - pose[:3, 3], -turned]) / fit.std[at]).tolist()
    return zeros, frames


def true_errors(arm, robots, shots, rng):
    """Errors [mm] at 4000 poses near the measured ones, the best frames before and after the arm granted."""
    q = rng.uniform(-0.9 * virtual.LIMIT, 0.9 * virtual.LIMIT, (4000, len(arm.dh)))
    truth = arm.poses(q, np.sign(rng.normal(size=q.shape)))
    near = np.linalg.norm(truth[:, None, :3, 3] - shots.truth[None, :, :3, 3], axis=2).min(1) < 0.15
    return [1e3 * virtual.rigid_error(wb.tool_poses(r, q[near]), truth[near]) for r in robots]


def draw(seed, name, kind, pictures, *, on_tool=False, solids=1):
    """One virtual arm: normalised errors of zeros and of camera and target, true errors [mm]."""
    rng = np.random.default_rng(seed)
    arm, joint = actual(rng, name, kind)
    shots = virtual.scene(rng, arm, pictures, on_tool=on_tool, solids=solids)
    robot, data = measured(shots, name, on_tool=on_tool, solids=solids)
    run = wb.identify(robot, data, algorithms=("opt2",), seed=seed)
    zeros, frames = normalised(run.best.fit, shots, arm)
    errors = true_errors(arm, (robot, run.robot), shots, rng)
    return _row(seed, name, kind, pictures, run, zeros, frames, errors, joint)


def splits(seed, name, kind, pictures, count):
    """One arm's pictures, divided at random several times: fitted, and true errors at the other pictures."""
    rng = np.random.default_rng(seed)
    arm, joint = actual(rng, name, kind)
    shots = virtual.scene(rng, arm, pictures)
    robot, data = measured(shots, name)
    for number in range(count):
        run = wb.identify(robot, data, algorithms=("opt2",), seed=1000 * seed + number, held_out=0.2)
        zeros, frames = normalised(run.best.fit, shots, arm)
        rest = run.held_out_rows
        errors = [
            1e3 * virtual.rigid_error(wb.tool_poses(r, data.q[rest]), shots.truth[data.row[rest]])
            for r in (robot, run.robot)
        ]
        yield _row(seed, name, kind, pictures, run, zeros, frames, errors, joint)


def _row(seed, name, kind, pictures, run, zeros, frames, errors, joint):
    return {
        "seed": seed,
        "what": f"{name} {kind}, {pictures} pictures",
        "step": run.identifiability.step.name,
        "zeros": list(zeros.values()),
        "frames": frames,
        "errors": errors,
        "expected": 1e3 * run.identifiability.step.expected,
        "uncertainty": 1e3 * run.identifiability.step.uncertainty,
        "shifted": None if joint is None else zeros.get(joint, 1e9),
    }


def inside(values):
    """Part of normalised errors inside 95 % intervals, in words."""
    flat = np.abs(np.array(values, float))
    return f"{100 * np.mean(flat < NORMAL):.1f} %" if len(flat) else "–"


def show(rows):
    """What the draws say, kind by kind, and step by step of the gate."""
    for what in dict.fromkeys(row["what"] for row in rows):
        mine = [row for row in rows if row["what"] == what]
        e = np.array([row["errors"] for row in mine])
        print(f"{what}: {len(mine)} fits; steps {dict(Counter(row['step'] for row in mine))}")
        for step in (None, *dict.fromkeys(row["step"] for row in mine)):
            some = [row for row in mine if step in (None, row["step"])]
            zeros, frames = ([v for row in some for v in row[k]] for k in ("zeros", "frames"))
            shifted = [row["shifted"] for row in some if row["shifted"] is not None]
            print(f"  inside 95 %: zeros {inside(zeros)}, camera and target {inside(frames)}", end="")
            print(f", shifted joint {inside(shifted)} ({step or 'all'})")
        far = e[:, 0] + 2.0 * np.array([row["uncertainty"] for row in mine])
        print(f"  true error nominal {e[:, 0].mean():.3f}, result {e[:, 1].mean():.3f} mm", end="")
        print(f" (max {e[:, 1].max():.3f}), expected {np.mean([row['expected'] for row in mine]):.3f}")
        print(f"  worse than nominal in {(e[:, 1] > e[:, 0] + 1e-6).sum()}", end="")
        print(
            f", by more than 5 µm {(e[:, 1] > e[:, 0] + 5e-3).sum()}, 2 σ {(e[:, 1] > far).sum()}", flush=True
        )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("words", nargs="*")
    parser.add_argument("--splits", type=int)
    parser.add_argument("--solids", type=int, default=1)
    parser.add_argument("--on-tool", action="store_true")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--show", type=Path, nargs="+", default=[])
    given = parser.parse_args()
    rows = [json.loads(line) for file in given.show for line in file.read_text().splitlines()]
    if given.words:
        name, kind, seeds = given.words[:3]
        pictures = int(given.words[3]) if len(given.words) > 3 else 60
        for seed in range(*map(int, seeds.split(":"))):
            found = (
                [draw(seed, name, kind, pictures, on_tool=given.on_tool, solids=given.solids)]
                if not given.splits
                else splits(seed, name, kind, pictures, given.splits)
            )
            for row in found:
                rows.append(row)
                if given.json:
                    with given.json.open("a") as file:
                        file.write(json.dumps(row) + "\n")
    show(rows)


if __name__ == "__main__":
    main()

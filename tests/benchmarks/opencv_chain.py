"""OpenCV's own chain beside workbench's fit, on the same pixels: errors in px and in mm, against the truth.

    python tests/benchmarks/opencv_chain.py [DRAWS] [PICTURES]

The chain: `solvePnP` on every picture, then camera and target by the closed form of Shah (Kronecker product),
since OpenCV 5 has no hand-eye calibration of its own; the arm stays nominal, as the chain knows no joints.
Virtual arms of `camera_arms`, which shares no code with the package, see tags on a dodecahedron: zeros off by
0.3° (one standard deviation) with a right geometry, or 0.2 mm of geometry with one joint shifted by up to 1°.
Beside them the public pictures of a board, if they are there, whose truth nobody knows.
"""

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "studies")]
import camera_arms as virtual
import camera_study as study

import workbench as wb

PUBLIC = Path(__file__).resolve().parents[3] / "shared" / "data" / "charuco_poses"


def seen_by_opencv(points, uv, intrinsics):
    """Pose of the target in the camera of every picture, by `solvePnP`."""
    lens = np.array([[intrinsics[0], 0, intrinsics[2]], [0, intrinsics[1], intrinsics[3]], [0, 0, 1.0]])
    poses = []
    for seen in uv:
        known = np.isfinite(seen[:, 0])
        _, turn, shift = cv2.solvePnP(points[known], seen[known], lens, intrinsics[4:])
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], shift.ravel()
        poses.append(pose)
    return np.array(poses)


def closed_form(tool, seen):
    """Camera X in the world and target Z on the tool with tool·Z = X·seen.

    Source: Shah, J. Mech. Robot. 5(3), 2013.
    """
    k = sum(np.kron(b[:3, :3], a[:3, :3]) for a, b in zip(tool, seen, strict=True))
    u, _, vt = np.linalg.svd(k)
    z, x = (_rotation(v.reshape(3, 3, order="F")) for v in (vt[0], u[:, 0]))
    left = np.vstack([np.hstack([np.eye(3), -a[:3, :3]]) for a in tool])
    right = np.concatenate([a[:3, 3] - x @ b[:3, 3] for a, b in zip(tool, seen, strict=True)])
    places = np.linalg.lstsq(left, right, rcond=None)[0]
    found = np.tile(np.eye(4), (2, 1, 1))
    found[0, :3, :3], found[0, :3, 3], found[1, :3, :3], found[1, :3, 3] = x, places[:3], z, places[3:]
    return found


def _rotation(m):
    u, _, vt = np.linalg.svd(m * np.sign(np.linalg.det(m)))
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


def chain(data, tool):
    """Camera, target and pixel error (a coordinate's root mean square) of the chain."""
    camera, uv = data.readings.rig.cameras[0], data.readings.pixels[:, 0]
    rows = np.isfinite(uv[..., 0]).sum(1) >= 6
    seen = seen_by_opencv(data.readings.rig.points, uv[rows], camera.intrinsics)
    x, z = closed_form(tool[rows], seen)
    points = np.linalg.inv(x) @ tool[rows] @ z
    at = np.einsum("rij,pj->rpi", points[:, :3, :3], data.readings.rig.points) + points[:, None, :3, 3]
    off = virtual.pixels(at, camera.intrinsics[:4], camera.intrinsics[4:]) - uv[rows]
    return x, float(np.sqrt(np.nanmean(off**2)))


def rms_px(run):
    return run.best.train.own.rms / np.sqrt(2.0)


def main():
    draws, pictures = (int(w) for w in (sys.argv[1:] + ["5", "40"][len(sys.argv) - 1 :])[:2])
    print(f"{'':22}{'px':>17}{'camera mm':>19}{'tool mm':>26}")
    print(f"{'arm':22}{'OpenCV':>9}{'ours':>8}{'OpenCV':>11}{'ours':>8}{'nominal=OpenCV':>16}{'ours':>10}")
    for name, kind in (("hobby", "zeros"), ("ur5", "zeros"), ("aria", "zeros"), ("industrial", "shift")):
        found = [compared(seed, name, kind, pictures) for seed in range(draws)]
        px, ours_px, camera, ours, nominal, tool = np.mean(found, axis=0)
        text = f"{px:9.2f}{ours_px:8.2f}{camera:11.2f}{ours:8.2f}{nominal:16.3f}{tool:10.3f}"
        print(f"{name + ' ' + kind:22}{text}", flush=True)
    if PUBLIC.is_dir():
        public()


def compared(seed, name, kind, pictures):
    """Errors of one virtual arm: px, the camera's distance from where it is, the tool's elsewhere [mm]."""
    rng = np.random.default_rng(seed)
    arm, _ = study.actual(rng, name, kind)
    shots = virtual.scene(rng, arm, pictures)
    robot, data = study.measured(shots, name)
    run = wb.identify(robot, data, algorithms=("opt2",), seed=seed)
    errors, truth = study.true_errors(arm, (robot, run.robot), shots, rng), shots.camera[0][:3, 3]
    x, px = chain(run.data, wb.tool_poses(run.nominal_robot, run.data.q))
    fit = run.best.fit
    ours = [fit.x[fit.problem.names.index(f"camera[c0].{axis}")] for axis in "xyz"]
    off = [1e3 * np.linalg.norm(place - truth) for place in (x[:3, 3], ours)]
    return px, rms_px(run), *off, *errors


def public():
    """The same on the public pictures, whose truth is not known: px alone, and how sure ours is."""
    lines = ["image,x[m],y[m],z[m],qw,qx,qy,qz"]
    for k in range(16):
        pairs = dict(s.split(": ") for s in (PUBLIC / f"poses/{k}.yaml").read_text().strip().split("\n"))
        lines.append(f"{k}.jpg," + ",".join(pairs[c] for c in ("x", "y", "z", "qw", "qx", "qy", "qz")))
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "poses.csv").write_text("\n".join(lines) + "\n")
        text = virtual.camera_toml(free="false", k=(1352.02747, 1356.14287, 789.67065, 627.2995))
        (place / "camera.toml").write_text(text)
        (place / "target.toml").write_text(
            'mounted = "tool"\n[charuco]\nsquares = [5, 7]\nsquare = 0.036195\nmarker = 0.018256\n'
        )
        rig = wb.read_rig(place / "camera.toml", place / "target.toml")
        data = wb.read_pixels(PUBLIC / "images", rig, joints=place / "poses.csv")
        run = wb.identify(None, data, algorithms=("opt2",), held_out=0.0)
        _, px = chain(data, run.nominal_robot.predict(data.q))
        fit = run.best.fit
        sure = max(fit.std[fit.problem.names.index(f"camera[c0].{axis}")] for axis in "xyz")
    message = f"{px:9.2f}{rms_px(run):8.2f}"
    print(f"{'public pictures':22}{message}   camera ±{1e3 * sure:.2f} mm by ours, unknown by the chain")


if __name__ == "__main__":
    main()

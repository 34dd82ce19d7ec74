"""An arm with a board on its tool before a camera: rendered pictures, joints and files, as a user has them.

Poses come from `generator`, pictures from `rendered_boards`; neither shares code with the package.
"""

import cv2
import numpy as np
from checks import dh_table
from generator import VirtualArm, four, rotation
from rendered_boards import render
from round_trip import write_table

LENS = np.array([780.0, 778.0, 322.0, 238.0, -0.11, 0.05, 8e-4, -5e-4, 0.0])
SIZE = (640, 480)
SQUARES, SQUARE, MARKER, DOT = (5, 7), 0.03, 0.0225, 0.25e-3
PRINTED = 1.003
"""Size of the print, relative to what target.toml says."""
CAMERA = """[[camera]]
name = "cell"
size = [640, 480]
fx = 775.0
fy = 775.0
cx = 320.0
cy = 240.0
distortion = [-0.1, 0.0, 0.0, 0.0, 0.0]
free = "auto"
"""
TARGET = """mounted = "tool"
[charuco]
squares = [5, 7]
square = 0.03
marker = 0.0225
dictionary = "DICT_6X6_250"
"""


def paper():
    """The board as OpenCV draws it."""
    drawn = cv2.aruco.CharucoBoard(
        SQUARES, SQUARE, MARKER, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    )
    return drawn.generateImage(tuple(round(n * SQUARE / DOT) for n in SQUARES))


def pose(xyz, turn):
    """A 4×4 pose from a place and a rotation vector."""
    return four(rotation(turn), xyz)


def photograph(robot, shifts, folder, *, count, fine=2):
    """Pictures `0.png` …, `joints.csv`, `camera.toml` and `target.toml` of an arm with shifted zeros.

    Args:
        robot: The arm as it is known.
        shifts: By which its zeros are off [rad].
        folder: Where.
        count: How many pictures.
        fine: Rays a pixel and direction.
    """
    rng = np.random.default_rng(0)
    sheet, rows = paper(), []
    for k, (row, target) in enumerate(_shots(robot, shifts, count, rng)):
        picture = render(sheet, DOT * PRINTED, target, LENS, SIZE, rng=rng, fine=fine)
        cv2.imwrite(str(folder / f"{k}.png"), picture)
        rows.append(row)
    head = ["image", *(f"q{k + 1}[rad]" for k in range(6))]
    write_table(folder / "joints.csv", head, ([f"{k}.png", *row.tolist()] for k, row in enumerate(rows)))
    (folder / "camera.toml").write_text(CAMERA)
    (folder / "target.toml").write_text(TARGET)


def _shots(robot, shifts, count, rng):
    """Joints, and the board's pose in the camera, of pictures in which it is well in view."""
    table = dh_table(robot)
    table[:, 0] += shifts
    arm = VirtualArm("hayati", table)
    board = pose([-0.075, 0.105, 0.03], [np.pi, 0.0, 0.0])  # its face looks along the tool's z axis
    eye = pose([0.45, 0.05, 0.0], [0.0, 0.0, 0.3])  # on the table, looking up
    while count:
        q = rng.uniform(
            np.clip(robot.limits[:, 0], -2.6, 2.6), np.clip(robot.limits[:, 1], -2.6, 2.6), (4000, 6)
        )
        at = np.linalg.inv(eye) @ arm.pose(q) @ board
        middle = at @ np.array([0.075, 0.105, 0.0, 1.0])
        spot = np.abs(middle[:, :2] / middle[:, 2:3]) * LENS[:2]
        near = (middle[:, 2] > 0.3) & (middle[:, 2] < 0.6) & (spot < [120, 60]).all(1) & (at[:, 2, 2] > 0.75)
        for row, target in list(zip(q[near], at[near], strict=True))[:count]:
            count -= 1
            yield row, target

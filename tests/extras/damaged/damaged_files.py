"""A small sound file of every kind that a stranger may send, what reads it, and damage done to it."""

import io
import json
import random
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import board_on_tool
import numpy as np
from binary_files import zipped
from PIL import Image

import workbench as wb
from workbench.exports import FORMS, Job, export_robot

Read = Callable[[Path], object]
TABLE = "q1[deg],q2[deg],x[mm],y[mm],z[mm],qw,qx,qy,qz,session,exclude,time[s]\n" + "".join(
    f"{i}.5,2e1,3,4,-5.25,1,0,0,0,a,false,{i}\n" for i in range(4)
)
JOINTS = (
    "# convention = dh\ntheta[deg],d[mm],a[mm],alpha[deg],type\n0,205,0,90,revolute\n90,0,410,0,prismatic\n"
)
OPTITRACK = (
    "Format Version,1.23,Capture Frame Rate,50,Rotation Type,Quaternion,Length Units,Meters\n\n,Type,"
    + "Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n,Name,"
    + "T,T,T,T,T,T,T\n,ID,1,1,1,1,1,1,1\n,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position\n"
    + "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z\n0,0,0,0,0,1,.1,.2,.3\n1,0.02,0,0,0,1,.1,.2,.3\n2,0.04,,,,,,,\n"
)
CAMERA = board_on_tool.CAMERA.replace("cell", "c") + 'mounted = "world"\n'
TARGET = 'mounted = "tool"\n' + "".join(
    f"[[point]]\nid = {k}\ncorner = 0\nxyz = [{0.05 * (k % 2)}, {0.05 * (k // 2)}, 0.0]\n" for k in range(4)
)
BOARDS = """mounted = "tool"
dictionary = "DICT_5X5_250"
[[board]]
charuco = { squares = [4, 3], square = 0.03, marker = 0.02, first_marker = 4 }
[[board]]
name = "tag"
scale_sigma = 0.001
point = [{ id = 40, corner = 0, xyz = [0, 0, 0] }, { id = 40, corner = 1, xyz = [0.1, 0, 0] }]
"""
PIXELS = "image,camera,id,corner,u[px],v[px],q1[rad],q2[rad]\n" + "".join(
    f"{i},c,{k},0,{320 + 60 * (k % 2)}.5,{240 + 60 * (k // 2)}.5,0.{i},0.2\n"
    for i in (1, 2)
    for k in range(4)
)
PAIRS = (
    "x[m],y[m],z[m],qx,qy,qz,qw,target_x[mm],target_y[mm],target_z[mm],target_qw,target_qx,target_qy,target_qz\n"
    + "0.4,0.2,0.3,0,0,0,1,100,20,700.5,1,0,0,0\n0.4,0.3,0.3,0,0,1,0,100,20,700.5,0,1,0,0\n" * 2
)
POSE = "".join(f"    - {value}\n" for value in np.eye(4).ravel())
MOVEIT = f"- effector_wrt_world:\n{POSE}  object_wrt_sensor:\n{POSE}" * 3
PENDANT = "J1,J2,J3,J4,J5,J6,X,Y,Z,A,B,C\n" + "10.5,20,30,40,50,60,700.1,200,300,10,20,30.5\n" * 3
TOUCHES = "q1[deg],q2[deg],q3[deg],q4[deg],q5[deg],q6[deg],contact\n" + "1,-60,80,4,5.5,6,a\n" * 4
PROGRAMS = {
    "a.mod": "MODULE Main\n MoveAbsJ [[1,2,3,4,5,6.5],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;\nENDMODULE\n",
    "a.src": "DEF a()\nPTP {A1 1.0,A2 2.0,A3 3.0,A4 4.0,A5 5.0,A6 6.0}\nEND\n",
    "a.script": "def a():\n  home = [0.1,0.2,0.3,0.4,0.5,0.6]\n  movej(home, a=1.4, v=1.05)\nend\n",
}
PICTURES = {"PNG": ".png", "JPEG": ".jpg", "BMP": ".bmp", "TIFF": ".tif", "WEBP": ".webp", "PPM": ".pgm"}
NASTY = (
    *(b"", b"\0", b"\r\n", b"\t", b",", b";", b"'", b'"', b"[", b"]", b"{", b"}", b"<", b">", b"=", b"#"),
    *(b"\xff", b"nan", b"inf", b"-1", b"1e999", b"1e308", b"9" * 30, b"9" * 5000, b"null", b"true", b"-"),
    *(b"[" * 2000, b"{" * 2000, b"\xe2\x88\x92", b"q1[deg]", b"x[mm]", b"joint", b"../", b"&a;"),
    *(b"[[joint]]", b"\x7f\xff\xff\xff", b"\xff\xff\xff\xff", b"Infinity", b"0.0, 0.0, 0.0"),
)
"""What damage puts in."""


def damaged(content: bytes, rng: random.Random) -> bytes:
    """Some bytes changed, cut, doubled or replaced; mostly few."""
    made = bytearray(content)
    for _ in range(1 if rng.random() < 0.6 else rng.randint(2, 8)):
        place, length, kind = rng.randrange(len(made) + 1), int(rng.expovariate(0.1)) + 1, rng.randrange(5)
        if kind == 0 and made:
            made[min(place, len(made) - 1)] = rng.randrange(256)
        elif kind == 1:
            del made[place : place + length]
        elif kind == 2:
            made[place:place] = made[place : place + length * 5]
        elif kind == 3:
            made[place : place + length] = rng.choice(NASTY)
        elif numbers := list(re.finditer(rb"[\d.]+", made)):
            number = rng.choice(numbers)
            made[number.start() : number.end()] = rng.choice(
                (b"0", b"-1", b"99999999999", b"1e400", b"1e300", b"x", b"")
            )
    return bytes(made)


@cache
def arm(name: str = "ur10") -> wb.Robot:
    return wb.load_robot(name)


def readers(folder: Path) -> dict[str, tuple[str, bytes, Read]]:
    """Name of the file, its sound content, and what reads it, by the kind of file.

    Args:
        folder: Where files lie that others need.
    """
    from workbench.data.readers.read import read_fields
    from workbench.extras.live.sample import parse_sample
    from workbench.extras.pendant.displayed import read_display
    from workbench.extras.pendant.own_robot.table_meanings import read_joint_table
    from workbench.extras.pendant.touching.touches import read_touches
    from workbench.extras.trajectories.programs import read_program
    from workbench.plate.plate_toml import write_plate

    pose = {"time": 1.5, "q": [0.1] * 6, "capture": True, "xyz": [0.4, 0.1, 0.3], "quat": [1, 0, 0, 0]}
    arm().save(folder / "arm.toml")
    arm().save(folder / "arm.urdf")
    write_plate(wb.load_plate("table2"), folder / "plate.toml")
    np.savez(folder / "rows.npz", q=np.zeros((3, 2)), xyz=np.ones((3, 3)))
    lines = "\n".join(json.dumps({"q": [0.1, k], "xyz": [0.4, 0.1, 0.3], "name": "a"}) for k in range(3))
    found: dict[str, tuple[str, str | bytes, Read]] = {
        "arrays": ("rows.npz", (folder / "rows.npz").read_bytes(), wb.read_measurements),
        "JSON": ("rows.jsonl", lines, wb.read_measurements),
        "measurements": ("rows.csv", TABLE, lambda path: wb.read_measurements(path, joints=2)),
        "trajectory": ("path.csv", TABLE, wb.read_trajectory),
        "robot": ("arm.toml", (folder / "arm.toml").read_bytes(), wb.load_robot),
        "URDF": ("arm.urdf", (folder / "arm.urdf").read_bytes(), wb.load_robot),
        "plate": ("plate.toml", (folder / "plate.toml").read_bytes(), wb.load_plate),
        "joint table": ("arm.csv", JOINTS, read_joint_table),
        "OptiTrack": ("take.csv", OPTITRACK, read_fields),
        "stream": ("live.jsonl", json.dumps(pose), lambda path: parse_sample(_text(path), line=1)),
        "pendant": ("readings.csv", PENDANT, lambda path: read_display(path, arm())),
        "touches": ("touches.csv", TOUCHES, lambda path: read_touches(path, arm(), None, None)),
        **{f"program {n}": (n, text, lambda path: read_program(path, 6)) for n, text in PROGRAMS.items()},
        **_of_cameras(folder),
        **_of_forms(folder),
        **_of_recordings(folder),
    }
    return {
        kind: (name, content.encode() if isinstance(content, str) else content, read)
        for kind, (name, content, read) in found.items()
    }


def _text(path: Path) -> str:
    return path.read_text(errors="replace")


def _of_cameras(folder: Path) -> dict[str, tuple[str, str | bytes, Read]]:
    from workbench.extras.camera.camera import read_cameras
    from workbench.extras.camera.corner_detection import read_picture
    from workbench.extras.camera.folder import unpacked
    from workbench.extras.camera.pixel_table import read_pixels
    from workbench.extras.camera.pose_pairs import read_pairs
    from workbench.extras.camera.rig import read_rig
    from workbench.extras.camera.target import read_targets

    (folder / "camera.toml").write_text(CAMERA)
    (folder / "target.toml").write_text(TARGET)
    rig = read_rig(folder / "camera.toml", folder / "target.toml")

    def archive(path: Path) -> None:
        with unpacked(path.name, path.read_bytes()):
            pass

    pixels = (255.0 * np.random.default_rng(0).random((60, 80))).astype(np.uint8)
    turned = Image.Exif()
    turned[0x0112] = 6
    pictures = {}
    for form, ending in PICTURES.items():
        file = io.BytesIO()
        Image.fromarray(pixels).save(file, form, **({} if form == "PPM" else {"exif": turned}))
        pictures[f"picture {ending}"] = (f"shot{ending}", file.getvalue(), read_picture)
    packed = zipped(("joints.csv", "image,q1[rad]\n0,0.1\n"), ("0.png", "no picture"))
    return pictures | {
        "cameras": ("camera.toml", CAMERA, read_cameras),
        "points": ("target.toml", TARGET, read_targets),
        "boards": ("target.toml", BOARDS, read_targets),
        "pixels": ("pixels.csv", PIXELS, lambda path: read_pixels(path, rig, dof=2)),
        "pairs": ("pairs.csv", PAIRS, read_pairs),
        "MoveIt pairs": ("pairs.yaml", MOVEIT, read_pairs),
        "pictures' archive": ("shots.zip", packed, archive),
    }


def _of_forms(folder: Path) -> dict[str, tuple[str, str | bytes, Read]]:
    """Files of controllers and drivers: imported, and brought up to date with a calibration."""
    from workbench.exports import applied

    arm("ur5e").save(folder / "ur5e.urdf")
    nominal = {"urdf": arm(str(folder / "ur5e.urdf"))}
    sound = {"urdf": (folder / "ur5e.urdf").read_text()}
    found: dict[str, tuple[str, str | bytes, Read]] = {}
    for name in ("dh-csv", "ur-calibration", "ur-kinematics", "urdf"):
        form, own = FORMS[name], nominal.get(name, arm("ur5e"))
        content = sound.get(name) or form.write(Job(robot=own, nominal=own))
        moved = "joint2.x" if name == "urdf" else "joint2.a"

        def apply(path: Path, name: str = name, own: wb.Robot = own) -> None:
            applied(own, path, name)

        def into(path: Path, form: Any = form, own: wb.Robot = own, moved: str = moved) -> None:
            better = own.with_values({moved: own.values((moved,))[0] + 1e-4})
            job = Job(robot=better, nominal=own, source=form.text_of(path))
            export_robot(form, path.with_name("out"), job, rows=5)

        if name != "urdf":
            found[f"{name} --apply"] = (f"apply{form.ending}", content, apply)
        if name != "dh-csv":
            found[f"{name} --into"] = (f"into{form.ending}", content, into)
    return found


def _of_recordings(folder: Path) -> dict[str, tuple[str, str | bytes, Read]]:
    """The journal, as somebody damages it and as somebody changes it who knows how its lines are sealed."""
    from workbench.session import Worker
    from workbench.session.commands.drag import SelectTarget
    from workbench.session.journal import codec
    from workbench.session.journal.folder import begin
    from workbench.session.journal.reader import JOURNAL, read_recording
    from workbench.session.journal.replay import restore

    begun = begin(arm("aria"), wb.load_plate("table2"), folder=folder / "recording")
    worker = Worker(begun.session, keepers=begun.keepers)
    for number in (1, 2, 3):
        worker.submit(SelectTarget(number))
    assert worker.wait()
    worker.close()

    def reopen(path: Path) -> None:
        (folder / "recording" / JOURNAL).write_bytes(path.read_bytes())
        restore(read_recording(folder / "recording"))

    def resealed(path: Path) -> None:
        lines = path.read_bytes().splitlines()
        path.write_bytes(b"".join(_sealed(line) + b"\n" for line in lines))
        reopen(path)

    def _sealed(line: bytes) -> bytes:
        seal = rb', "check": "\w+"\}$'
        again = codec.sealed(re.sub(seal, b"}", line).decode(errors="replace")).encode()
        return again if re.search(seal, line) else line

    content = (folder / "recording" / JOURNAL).read_bytes()
    return {
        "recording": ("journal.jsonl", content, reopen),
        "sealed recording": ("journal.jsonl", content, resealed),
    }

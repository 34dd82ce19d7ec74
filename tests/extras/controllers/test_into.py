"""The calibrated numbers in a file of the user's own, read by other code; nothing else of it changes."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import yourdfpy
from checks import any_joints
from lxml import etree

from tests.exports.readers import origin
from tests.exports.test_exports import EXACT, calibrated, flanges
from workbench.arm.joint_frames import joint_frames
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.errors import FileError
from workbench.exports import FORMS, Exported, Job, export_robot
from workbench.extras.controllers.into import MARK

MICRON = 1e-6
POSE = ("xyz", "rpy")
STAND = origin(0.3, -0.2, 0.7, 0.0, 0.0, np.pi / 2)
"""Where the files have the arm's base in their root."""
Chain = list[tuple[np.ndarray, np.ndarray, bool]]


def text(numbers) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(numbers))


def rpy(pose: np.ndarray) -> np.ndarray:
    return se3.matrix_to_rpy(pose[:3, :3])


def chain_of(robot: Robot, *, digits: int | None = None) -> tuple[Chain, np.ndarray]:
    """Frames of a file in its root, turned about and moved along their axes as meshes like; and its flange.

    With rounded numbers the arm's base is the root, and frames are the joints' own.
    """
    frames, rng = joint_frames(robot), np.random.default_rng(3)
    stand = STAND if digits is None else np.eye(4)
    found = []
    for pose, joint in zip(frames.at_zero, frames.joints, strict=False):
        turn = se3.rotvec_to_matrix(joint.axis * rng.uniform(-2, 2)) if digits is None else np.eye(3)
        place = stand @ pose @ se3.pose(turn, joint.axis * (0.03 if digits is None else 0.0))
        if digits is not None:
            place[:3, 3] = place[:3, 3].round(digits)
        found.append((place, joint.axis, joint.joint.kind == "revolute"))
    return found, stand @ frames.at_zero[-1]


def steps(chain: Chain, flange: np.ndarray) -> list[np.ndarray]:
    poses = [np.eye(4), *(pose for pose, *_ in chain), flange]
    return [np.linalg.inv(a) @ b for a, b in pairwise(poses)]


def urdf(chain: Chain, flange: np.ndarray) -> str:
    out = "<?xml version='1.0'?>\r\n<robot name='mine'><!-- as bought: é -->\n"
    out += "".join(f"<link name='l{k}'/>\t\n" for k in range(len(chain) + 2)) + "<link name='lamp'/>\n"
    out += "<joint name='of_lamp' type='fixed'><parent link='l0'/><child link='lamp'/>"
    out += "<origin xyz='1 2 3.00'/></joint>"
    for k, step in enumerate(steps(chain, flange)):
        kind, axis = "fixed", np.zeros(3)  # as xacro writes it
        if k < len(chain):
            kind, axis = "continuous" if chain[k][2] else "prismatic", chain[k][1]
        out += f"""
  <joint type="{kind}"   name="axis{k}">
     <parent link='l{k}'/> <child link='l{k + 1}'/> <limit lower='-9' upper="9" effort='1' velocity='1'/>
     <origin rpy = '{text(rpy(step))}'
             xyz="{text(step[:3, 3])}" /> <!-- <origin xyz="7 7 7"/> -->
     <axis xyz='{text(axis)}'/>
  </joint>"""
    return out + "\n</robot>\n"


def urdf_flanges(path: Path, q: np.ndarray, end: str = "") -> np.ndarray:
    model = yourdfpy.URDF.load(path, load_meshes=False, build_scene_graph=True)
    out = []
    for row in q:
        model.update_cfg(row)
        out.append(model.get_transform(end or f"l{q.shape[1] + 1}", "l0"))
    return np.array(out)


def written(source: str, arm: Robot, nominal: Robot, folder: Path) -> Exported:
    job = Job(robot=arm, nominal=nominal, source=source)
    return export_robot(FORMS["urdf"], folder / "out.urdf", job, rows=20)


def content(text: str) -> list:
    """All of a file but the numbers of poses: elements, comments, other attributes, in order."""
    nodes = etree.fromstring(text.encode()).iter()
    return [
        (n.text, n.tail) if n.tag is etree.Comment else (n.tag, {k: v for k, v in n.items() if k not in POSE})
        for n in nodes
    ]


@pytest.mark.parametrize("name", built_in_robots())
def test_a_file_of_ones_own_becomes_the_calibrated_arm_and_nothing_else_of_it_changes(name, tmp_path):
    nominal, arm = calibrated(name)
    source = urdf(*chain_of(nominal))
    done = written(source, arm, nominal, tmp_path)
    found, q = done.path.read_bytes().decode(), any_joints(arm, 20, seed=1)
    assert [c for c in content(found) if c[0] != MARK] == content(source)
    wanted = STAND @ flanges(arm, q)
    (tmp_path / "nominal").write_text(source)
    assert np.abs(urdf_flanges(tmp_path / "nominal", q) - wanted).max() > 1e-4
    np.testing.assert_allclose(urdf_flanges(done.path, q), wanted, rtol=0.0, atol=MICRON)
    assert max(done.position, done.rotation) < MICRON
    assert any("order" in note and "a" in note for note in done.notes)


def test_a_file_with_rounded_numbers_gets_the_calibrated_axes_exactly(tmp_path):
    """What is left is a constant at the flange: rounding there can't be told from another flange."""
    nominal, arm = calibrated("ur5e")
    done = written(urdf(*chain_of(nominal, digits=3)), arm, nominal, tmp_path)
    q = any_joints(arm, 20, seed=1)
    left = np.linalg.inv(flanges(arm, q)) @ urdf_flanges(done.path, q)
    np.testing.assert_allclose(left, np.broadcast_to(left[0], left.shape), rtol=0.0, atol=EXACT)
    assert np.abs(left[0] - np.eye(4)).max() < 2e-3


def test_joints_are_matched_by_name_where_the_calibration_has_names(tmp_path):
    """A rail before the arm stays what it is."""
    nominal, arm = calibrated("ur5")
    chain, flange = chain_of(nominal)
    rail = (np.eye(4), np.array([0.0, 1.0, 0.0]), False)
    names = iter(["rail", *(f"joint{k}" for k in range(1, 7)), "end"])
    source = re.sub(r'"axis\d"', lambda _: f'"{next(names)}"', urdf([rail, *chain], flange))
    done = written(source, arm, nominal, tmp_path)
    q = any_joints(arm, 20, seed=1)
    found = urdf_flanges(done.path, np.column_stack([np.full(len(q), 0.4), q]))
    wanted = se3.pose(np.eye(3), np.array([0.0, 0.4, 0.0])) @ STAND @ flanges(arm, q)
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=MICRON)
    assert not any("order" in note for note in done.notes)


def test_a_file_that_ends_at_the_last_joint_says_where_the_flange_is(tmp_path):
    nominal, arm = calibrated("ur5e")
    chain, flange = chain_of(nominal)
    source = re.sub(
        r'<joint type="fixed"   name="axis6">.*</joint>', "", urdf(chain, flange), flags=re.DOTALL
    )
    source = source.replace("<link name='l7'/>\t\n", "")
    done = written(source, arm, nominal, tmp_path)
    assert max(done.position, done.rotation) < EXACT
    note = next(n for n in done.notes if "'axis5'" in n and "tool" in n)
    xyz, turn = (
        np.array(part.split(", "), float) for part in re.findall(r"(-?[\d.]+, -?[\d.]+, -?[\d.]+)", note)
    )
    tool = se3.pose(se3.rotvec_to_matrix(turn), xyz / 1e3)
    q = any_joints(arm, 20, seed=1)
    wanted = STAND @ flanges(arm, q) @ arm.tool.pose
    np.testing.assert_allclose(urdf_flanges(done.path, q, "l6") @ tool, wanted, rtol=0.0, atol=1e-6)


def swapped(old: str, new: str) -> str:
    source = urdf(*chain_of(calibrated("ur5")[0]))
    assert old in source
    return source.replace(old, new, 1)


@pytest.mark.parametrize(("old", "new", "message"), [
    ('xyz="', 'xyz="${d1} ', r"line 16 .*\$\{d1\}"),
    ('xyz="', 'xyz="1e999 ', "line 16 "),
    ("<axis xyz='", "<axis xyz='0 0 0' was='", "line 17 "),
    ("<robot", "<arm", "XML"),
    ("<robot", "<robot><!-- calibrated by workbench --></robot><robot", "XML"),
    ("<link", "<!-- calibrated by workbench --><link", "calibration already"),
    ("<link", "<!-- \ufffd --><link", "UTF-8"),
    ("<?xml version='1.0'?>", "<!DOCTYPE robot [<!ENTITY a 'b'>]>", "DOCTYPE"),
    ("<child link='l1'", "<child link='l6'", "l"),
    ("<parent link='l0'/><child link='lamp'", "<parent link='lamp'/><child link='lamp'", "lamp"),
    ("continuous", "planar", "axis0"),
    ("continuous", "fixed", "6 joints"),
    ("axis2", "joint2", "joint1"),
])  # fmt: skip
def test_what_can_not_be_written_is_refused_and_said(old, new, message, tmp_path):
    nominal, arm = calibrated("ur5")
    with pytest.raises(FileError, match=message):
        written(swapped(old, new), arm, nominal, tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("name", "other"), [("ur5e", "ur5"), ("ur10e", "ur10"), ("iiwa14", "iiwa7")])
def test_a_file_of_another_arm_is_refused_with_how_far_it_is(name, other, tmp_path):
    nominal, arm = calibrated(name)
    source = urdf(*chain_of(calibrated(other)[0]))
    with pytest.raises(FileError, match=r"nominal arm.* \d+\.?\d* mm and .* off"):
        written(source, arm, nominal, tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_command_leaves_the_file_as_it_is_and_lists_forms_without_an_arm(run, refused, tmp_path):
    rows, toml, mine, out = (tmp_path / n for n in ("rows.csv", "c.toml", "mine.urdf", "out.urdf"))
    assert run("simulate", "--robot", "ur5", "--poses", 40, "--seed", 1, "--out", rows)[0] == 0
    run("identify", rows, "--robot", "ur5", "--save", toml)
    source = urdf(*chain_of(calibrated("ur5")[0]))
    mine.write_bytes(source.encode())
    code, message, _ = run("export", toml, "--for", "urdf", "--into", mine, "--out", out)
    assert code == 0
    assert str(out) in message
    assert mine.read_bytes() == source.encode() != out.read_bytes()
    mine.write_bytes(b"<robot name='\xe9'/>")
    out.unlink()
    refused([], "export", toml, "--for", "urdf", "--into", mine, "--out", out)
    code, message, _ = run("export", "--for", "list")
    assert code == 0
    assert all(name in message for name in FORMS)
    refused(["robot"], "export", "--for", "urdf", "--out", out, status=64)

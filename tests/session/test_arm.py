"""Another robot, another plate, jogging; rows left out and parameters held; the hidden effect. How long what
extras keep in the session stays."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import trimesh
from binary_files import zipped
from refusals import mentions, refuses

from workbench import Motion, load_robot, tool_poses, write_plate, write_toml, write_urdf
from workbench.arm.meshes import link_meshes
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.plate.optimiser.constraints import is_clear_of
from workbench.session.commands.arm import ChooseRobot, Jog, JogTo, LoadModel, drawn_joints, holds_robot
from workbench.session.commands.data import MeasureVirtualArm, with_data
from workbench.session.commands.drag import MoveTarget
from workbench.session.commands.identify import Identify
from workbench.session.export import calibrated_urdf
from workbench.session.page_state import Severity
from workbench.session.part import AbstractPart, GoesWith
from workbench.session.state import Focus


def test_another_robot_gets_a_plate_that_it_reaches(do):
    session = do(ChooseRobot("katana450"))
    assert session.robot.name == load_robot("katana450").name
    assert session.score.measurable == 10
    assert session.plate.name == "Circle"
    assert mentions(session.page.messages[-1].text, "10 of 10")


@pytest.mark.parametrize(("name", "plate"), [("panda", "Circle"), ("ur5", "Table 2")])
def test_an_edited_plate_goes_with_a_robot_in_whose_base_it_does_not_stand(do, first, name, plate):
    """Table 2 reaches into a Panda's base, where nothing of it could be improved or made."""
    x, y, z = first.plate.targets[0].xyz
    do(MoveTarget(0, (x, y - 0.01, z), tuple(first.plate.targets[0].rpy)))
    session = do(ChooseRobot(name))
    assert session.plate.name == plate
    assert is_clear_of(session.robot, session.plate)


def test_a_plate_goes_with_a_robot_of_other_joints_without_its_joint_positions(do, first, tmp_path):
    targets = tuple(replace(t, q=s.q) for t, s in zip(first.plate.targets, first.states, strict=True))
    path = write_plate(replace(first.plate, targets=targets), tmp_path / "p.toml")
    assert do(LoadModel("p.toml", path.read_bytes())).plate.targets[0].q is not None
    session = do(ChooseRobot("iiwa7"))
    assert (session.plate.name, session.robot.dof) == (first.plate.name, 7)
    assert all(target.q is None for target in session.plate.targets)


def test_files_of_robots_and_plates_are_opened(do, first, tmp_path):
    plate = write_plate(do(MoveTarget(0, (0.5, 0.3, 0.25), (-2.6, 0.0, 0.0))).plate, tmp_path / "p.toml")
    robot = write_toml(load_robot("ur5"), tmp_path / "r.toml")
    session = do(LoadModel("mine.toml", robot.read_bytes()))
    assert session.robot.dof == 6
    assert session.robot.name == load_robot("ur5").name
    session = do(LoadModel("../p.toml", plate.read_bytes()))
    assert session.plate.targets[0].xyz.tolist() == [0.5, 0.3, 0.25]
    assert session.history.first.plate is session.plate


def test_jogging_by_joints_and_by_pose(do, first):
    q = tuple(0.9 * first.states[0].q)
    session = do(Jog(q))
    assert session.playback.focus is Focus.JOG
    assert np.array_equal(drawn_joints(session), q)
    wanted = tool_poses(first.robot, Motion(np.array([q])))[0]
    place = wanted[:3, 3] + [0.0, 0.02, 0.01]
    session = do(JogTo(tuple(place.tolist()), tuple(se3.matrix_to_rpy(wanted[:3, :3]).tolist())))
    there = tool_poses(first.robot, Motion(session.playback.jogged[None]))[0][:3, 3]
    assert there == pytest.approx(place, abs=1e-7)
    assert do(JogTo((5.0, 0.0, 0.0), (0.0, 0.0, 0.0))).page.messages[-1].severity is Severity.WARNING


def test_a_urdf_from_the_page_is_corrected_in_a_copy(do, tmp_path):
    """The uploaded file is there as long as its robot, whose calibrated copies are made of it."""
    path = write_urdf(load_robot("aria"), tmp_path / "own.urdf")
    session = do(LoadModel("own.urdf", path.read_bytes()), MeasureVirtualArm(2), Identify(("ols",)))
    name, content = calibrated_urdf(session)
    assert name == "aria-calibrated.urdf"
    assert b"<robot" in content


JOINT = '<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
URDF = f"""<robot name="one"><link name="base"/><link name="arm"><visual><geometry>
<mesh filename="package://one/meshes/arm.stl"/></geometry></visual></link><link name="hand"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="arm"/>{JOINT}
<joint name="j2" type="revolute"><parent link="arm"/><child link="hand"/>
<origin xyz="0.3 0 0" rpy="1 0 0"/>{JOINT}</robot>"""


def test_a_urdf_in_an_archive_brings_its_meshes(first):
    stl = trimesh.creation.box((0.3, 0.05, 0.05)).export(file_type="stl")
    for meshes in ({"one/meshes/arm.stl": stl}, {}):
        command = LoadModel("arm.zip", zipped(("one/urdf/one.urdf", URDF), *meshes.items()))
        assert holds_robot(command.name, command.content)
        session = command.finish(first, command.compute(first))
        assert [len(mesh.faces) for mesh in link_meshes(session.robot)] == [12] * len(meshes)
        assert ("shown without its meshes" in session.page.messages[-1].text) is not bool(meshes)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"PK\x03\x04 no archive", "damaged archive"),
        (zipped(("arm.stl", b"x")), "found none"),
        (zipped(("a.urdf", URDF), ("b/b.urdf", URDF)), "found a.urdf, b.urdf"),
    ],
)
def test_an_archive_without_one_urdf_is_refused(first, content, why):
    with refuses(OptionError, "arm.zip", why):
        LoadModel("arm.zip", content).compute(first)


@dataclass(frozen=True)
class OfRows(AbstractPart):
    goes_with = GoesWith.MEASUREMENTS
    value: int = 0


@dataclass(frozen=True)
class OfPlate(AbstractPart):
    value: int = 0


def test_parts_are_kept_by_type_and_as_long_as_what_they_go_with(first):
    session = first.with_part(OfRows(1)).with_part(OfPlate(2))
    assert session.with_part(OfRows(3)).part(OfRows) == OfRows(3)
    kept = (session.part(OfRows), session.part(OfPlate), first.part(OfRows))
    assert kept == (OfRows(1), OfPlate(2), None)
    for without in (session.without_part(OfRows), with_data(session, None)):
        assert (without.part(OfRows), without.part(OfPlate)) == (None, OfPlate(2))

"""The command line refuses to fit rows that are clearly those of another arm."""

import json

import pytest
from refusals import mentions

FEW = ("--algorithm", "opt2", "--json", "r.json")


@pytest.fixture
def rows(run, tmp_path):
    status, _, err = run("simulate", "--robot", "ur5", "--poses", 40, "--seed", 2, "--out", "ur5.csv")
    assert status == 0, err
    return tmp_path / "ur5.csv"


def test_rows_of_another_arm_give_no_result_unless_forced(run, rows, tmp_path):
    for command in ("identify", "diagnose"):
        status, _, err = run(command, rows, "--robot", "aria", "--json", "r.json")
        assert status == 1
        assert mentions(err, "UR5 (CB3)")
        assert "--force" in err
        assert not (tmp_path / "r.json").exists()
    run("identify", rows, "--robot", "aria", "--force", *FEW)
    result = json.loads((tmp_path / "r.json").read_text())
    assert any("UR5 (CB3) fits to" in text for text in result["warnings"])
    status, _, err = run("identify", rows, "--robot", "ur5", *FEW)
    assert status == 0, err
    assert not any("fits to" in text for text in json.loads((tmp_path / "r.json").read_text())["warnings"])


JAW = """<robot name="desk"><link name="base"/><link name="l1"/><link name="l2"/><link name="l3"/>
<link name="hand"/><link name="jaw"/><link name="tip"/>
{joints}
<joint name="open" type="revolute"><origin xyz="0.02 0.01 0.03"/><parent link="hand"/><child link="jaw"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="end" type="fixed"><origin xyz="0 0 0.09"/><parent link="hand"/><child link="tip"/></joint>
</robot>"""


def test_of_an_arm_with_a_jaw_the_chain_is_named_and_holds(run, tmp_path):
    """Rows have the arm's four joints; the longest chain of its URDF has five."""
    joints = "\n".join(
        f'<joint name="j{k}" type="revolute"><origin xyz="0.1 0 {z}"/><parent link="{a}"/><child link="{b}"/>'
        f'<axis xyz="{axis}"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>'
        for k, (a, b, z, axis) in enumerate(
            (
                ("base", "l1", 0.2, "0 0 1"),
                ("l1", "l2", 0.1, "0 1 0"),
                ("l2", "l3", 0.2, "0 1 0"),
                ("l3", "hand", 0.1, "1 0 0"),
            )
        )
    )
    (tmp_path / "arm.urdf").write_text(JAW.format(joints=joints))
    run("export", "arm.urdf", "--tip", "tip", "--toml", "short.toml", "--urdf", "short.urdf")
    for robot in ("short.toml", "short.urdf"):
        status, _, err = run("simulate", "--robot", robot, "--poses", 30, "--out", "rows.csv")
        assert status == 0, err
        assert (tmp_path / "rows.csv").read_text().count("q5") == 0
    for command in ("identify", "diagnose", "evaluate"):
        status, _, err = run(command, "rows.csv", "--robot", "arm.urdf")
        assert status == 1
        assert mentions(err, "--tip tip")
    status, _, err = run("identify", "rows.csv", "--robot", "arm.urdf", "--tip", "tip", "--save", "cal.urdf")
    assert status == 0, err
    assert run("evaluate", "rows.csv", "--robot", "cal.urdf")[0] == 0

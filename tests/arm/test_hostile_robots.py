"""Robot files that would end in a bare exception or never: one sentence each."""

import pytest
from refusals import mentions

from workbench.arm.built_in_arms import load_robot
from workbench.base.errors import FileError
from workbench.plate.plate_toml import load_plate

JOINT = '<joint name="{0}{1}" type="continuous"><parent link="{0}"/><child link="{1}"/></joint>'


def refusal(tmp_path, name: str, text: str) -> str:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(FileError) as caught:
        load_robot(path)
    assert len(str(caught.value)) <= 300
    return str(caught.value)


def test_too_many_joints(tmp_path):
    head = 'name = "x"\nconvention = "dh"\n'
    assert mentions(refusal(tmp_path, "a.toml", head + "[[joint]]\na=0.1\n" * 51), "51 joints", 50)
    assert mentions(refusal(tmp_path, "b.toml", head + "[[joint]]\n" * 3000), "3000 [[joint]]")


@pytest.mark.parametrize("read", [load_robot, load_plate])
def test_a_number_of_thousands_of_digits(tmp_path, read):
    (tmp_path / "digits.toml").write_text(f"a = {'9' * 5000}")
    with pytest.raises(FileError, match="valid TOML"):
        read(tmp_path / "digits.toml")


@pytest.mark.parametrize("read", [load_robot, load_plate])
def test_nested_toml(tmp_path, read):
    (tmp_path / "deep.toml").write_text("a = " + 1500 * "[")
    with pytest.raises(FileError, match="brackets"):
        read(tmp_path / "deep.toml")


def test_a_link_in_mid_chain_that_is_not_declared(tmp_path):
    links = '<link name="a"/><link name="c"/>'
    found = refusal(
        tmp_path, "r.urdf", f'<robot name="r">{links}{JOINT.format("a", "b")}{JOINT.format("b", "c")}</robot>'
    )
    assert "link 'b'" in found

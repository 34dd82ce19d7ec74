"""Robot files that would end in a bare exception or never: one sentence each."""

from dataclasses import replace

import pytest
from refusals import mentions

from workbench.arm.built_in_arms import load_robot
from workbench.arm.urdf import read_urdf
from workbench.arm.urdf_writer import write_urdf
from workbench.base.errors import FileError
from workbench.base.progress import Cancelled, running
from workbench.plate.plate_toml import load_plate
from workbench.session.start import start

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


@pytest.mark.parametrize("encoding", ["utf-88", "utf-16"])
def test_an_encoding_that_there_is_not(tmp_path, encoding):
    assert refusal(tmp_path, "r.urdf", f'<?xml version="1.0" encoding="{encoding}"?><robot name="r"/>')


def test_a_root_that_is_not_declared_is_written_again(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(f'<robot name="r"><link name="b"/>{JOINT.format("a", "b")}</robot>')
    copy = write_urdf(read_urdf(path), tmp_path / "copy.urdf")
    assert read_urdf(copy).dof == 1


def test_too_many_links(tmp_path):
    links = "".join(f'<link name="l{i}"/>' for i in range(1001))
    assert mentions(
        refusal(tmp_path, "r.urdf", f"<robot>{links}{JOINT.format('l0', 'l1')}</robot>"), "1001 links"
    )


def test_the_beginning_of_a_session_can_be_cancelled(aria):
    with pytest.raises(Cancelled), running(cancel=lambda: True):
        start(replace(aria), load_plate("table2"))  # not one that has been begun before

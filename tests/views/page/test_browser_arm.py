"""The arm in a real Chromium: a file with meshes, jogging; dark pages, help, downloads."""

from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.arm.joint_units import joint_titles
from workbench.arm.meshes import link_meshes
from workbench.plate.plate_toml import read_plate
from workbench.session.commands.arm import Jog, drawn_joints
from workbench.session.start import default_circle, start
from workbench.views.appearance.bodies import body_frames

FILES = distribution("example-robot-data").files or []


def urdf(name: str) -> Path:
    return Path(str(next(f for f in FILES if f.name == name).locate())).resolve()


def test_meshes_of_a_urdf_hang_on_their_links():
    robot = load_robot(urdf("ur5_robot.urdf"))
    pieces = link_meshes(robot)
    assert {p.entry for p in pieces} >= set(range(1, 7))
    assert link_meshes(load_robot("aria")) == ()
    assert sum(len(p.faces) for p in pieces) > 10_000
    entries = {p.entry for p in pieces}
    links = [np.concatenate([p.vertices for p in pieces if p.entry == entry]) for entry in entries]
    longest = max(np.ptp(vertices, axis=0).max() for vertices in links)
    assert longest == pytest.approx(0.55, abs=0.1)  # the upper arm is 425 mm from axis to axis


@pytest.mark.browser
def test_another_arm_is_chosen_jogged_and_the_page_made_dark(app, look, tmp_path):
    screen = look()
    ur5 = load_robot(urdf("ur5_robot.urdf"))
    screen.show(start(ur5, default_circle(ur5)))
    for i, frame in enumerate(body_frames(ur5, drawn_joints(app.worker.session))):
        screen.wait_node(f"/arm/nominal/body{i}", frame[:3, 3])
    screen.tab("Robot")
    slider = screen.page.get_by_role("textbox", name=f"{joint_titles(ur5)[0]} [°]", exact=True)
    slider.fill("40")
    slider.press("Tab")
    screen.until(lambda session: abs(drawn_joints(session)[0] - np.deg2rad(40.0)) < 1e-6)
    screen.choose("Robot", "katana450-tilting")
    screen.wait_text("arm", "Katana 450, tilting")
    app.worker.submit(Jog((0.0, 0.5, 0.5, 0.0, 0.0)))
    screen.page.wait_for_function("'/arm/calibrated/body5' in window.__viserMutable.nodePoseData")
    bent, straight = (screen.node(f"/arm/{name}/body5")[:3] for name in ("calibrated", "nominal"))
    assert not np.allclose(bent, straight, atol=5e-3)
    screen.tab("Export")

    with screen.page.expect_download() as download:
        screen.press("Plate (TOML)")
    saved = tmp_path / "plate.toml"
    download.value.save_as(saved)
    assert len(read_plate(saved)) == len(app.worker.session.plate)

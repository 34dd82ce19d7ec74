"""A circle drawn and read back: profile and Cartesian errors against what the arm really did."""

import re
from pathlib import Path

import generator
import numpy as np
import pytest
from PIL import Image
from refusals import refuses
from studies.katana_paths import circle_through, plan
from studies.pencil_scan import Drawn, draw, scan

from workbench import Frame, Motion, load_robot, tool_poses
from workbench.base.errors import DataError
from workbench.extras.katana.pencil import ANGLES, INCH, plotted_errors, plotted_profile, sheet

RADIUS, DOTS = 0.08, 150.0
PHI = np.linspace(0.0, 2.0 * np.pi, 361)
WAVES = 1e-3 * (0.1 + 0.3 * np.cos(PHI + 0.4) + 0.2 * np.sin(2 * PHI) + 0.1 * np.cos(5 * PHI))
"""How far outside the circle the pencil ran [m]."""


def stroke(out=WAVES):
    points = (RADIUS + out)[:, None] * np.stack([np.cos(PHI), np.sin(PHI)], 1)
    return Drawn(points=points, extension=np.zeros(len(PHI)))


def scanned(drawn, clockwise=False, turned=0.3, seed=0, dpi=DOTS):
    rng = np.random.default_rng(seed)
    lies = {"turned": turned, "shifted": (1e-3, -2e-3)}
    return scan(drawn, RADIUS, clockwise=clockwise, rng=rng, dpi=dpi, **lies)


@pytest.mark.parametrize("clockwise", [False, True])
def test_a_drawn_line_is_read_to_a_fraction_of_a_dot(clockwise):
    """However the sheet lies; 0.17 mm a dot, a pencil of 0.5 mm with grain."""
    for turned in (0.0, 2.5):
        found = plotted_profile(scanned(stroke(), clockwise, turned), RADIUS)
        read = np.interp((-PHI if clockwise else PHI)[2:-2], ANGLES, found, period=2.0 * np.pi)
        error = read - WAVES[2:-2]
        assert np.sqrt(np.mean(error**2)) < 0.03e-3
        assert np.abs(error).max() < 0.1e-3
        assert abs(error.mean()) < 0.01e-3
        assert np.isfinite(found).all()


def test_a_lifted_pencil_leaves_a_gap():
    image = scanned(stroke(), turned=0.0)
    middle = image.shape[0] // 2
    image[: middle - 100, middle - 60 : middle + 60, 0] = 245  # no graphite left at the top
    found = plotted_profile(image, RADIUS)
    top = np.abs(ANGLES - np.pi / 2) < 0.1
    assert np.isnan(found[top]).all()
    assert np.isfinite(found[np.abs(ANGLES - np.pi / 2) >= 0.3]).all()


def test_scan_and_potentiometer_give_cartesian_errors():
    """The tip's errors in the robot's base, though the pencil leans by 10° and slides.

    Poses miss a circle on a slanted plane by tenths of a mm.
    """
    turn = generator.rotation(np.array([0.9, 0.2, -0.4]))
    along, across, centre = turn[:, 0], turn[:, 1], np.array([0.1, -0.3, 0.2])
    normal = np.cross(along, across)
    ray = np.cos(PHI)[:, None] * along + np.sin(PHI)[:, None] * across
    out, above = WAVES, 1e-3 * (0.2 * np.sin(PHI) - 0.15)
    axis = generator.rotation(np.deg2rad(10.0) * along) @ normal
    turned = np.stack([np.cross(across, axis), across, axis], 1)
    poses = generator.four(turned, centre + (RADIUS + out)[:, None] * ray + above[:, None] * normal)
    drawn = draw(poses, centre, along, across)
    flat = np.linalg.norm(drawn.points, axis=1) - RADIUS
    assert np.abs(flat - out).max() > 0.03e-3  # the leaning pencil alone would mislead
    profile = plotted_profile(scanned(drawn, clockwise=True), RADIUS)
    ideal, circle = centre + RADIUS * ray, {"centre": centre, "along": along, "across": across}
    found = plotted_errors(profile, ideal, poses[:, :3, 2], drawn.extension, **circle)
    np.testing.assert_allclose(found[2:-2] @ normal, above[2:-2], atol=1e-6)
    inner = slice(2, -2)
    wanted = out[:, None] * ray + above[:, None] * normal
    assert np.linalg.norm(found[inner] - wanted[inner], axis=1).mean() < 0.04e-3


def test_what_is_no_circle_is_said():
    image = scanned(stroke(), turned=0.0)
    high = image.shape[0]
    with pytest.raises(DataError, match="red"):
        plotted_profile(np.full_like(image, 255), RADIUS)
    with refuses(DataError, "50 %"):
        plotted_profile(image[:, : high // 2], RADIUS)
    squeezed = np.asarray(Image.fromarray(image).resize((high, int(0.95 * high))))
    with refuses(DataError, "2.6 %"):
        plotted_profile(squeezed, RADIUS)
    with refuses(DataError, "0 %", found=0.0):
        plotted_profile(sheet(RADIUS, dpi=DOTS), RADIUS)
    unmarked = image.copy()
    unmarked[:, int(high / 2 + 1.06 * RADIUS / INCH * DOTS) :] = 245
    with refuses(DataError, "scan the whole sheet"):
        plotted_profile(unmarked, RADIUS)


def test_the_page_reads_what_a_tilting_arm_drew(tmp_path, monkeypatch, capsys):
    """Of 1.0 mm, 0.9 mm are vertical and 0.4 mm radial."""
    monkeypatch.chdir(tmp_path)
    page = Path(__file__).resolve().parents[3] / "assets/docs/pencil.md"
    begin, read = re.findall(r"```(?:python|text)\n(.*?)```", page.read_text(), re.DOTALL)
    names: dict = {}
    exec(begin, names)
    centre, along, across = names["frame"].values()
    circle, normal = circle_through(
        np.array([centre + 0.1 * along, centre + 0.1 * across, centre - 0.1 * along])
    )
    path = plan(load_robot("katana450"), circle, normal, duration=8.0, rows=200)
    np.savetxt("joints.txt", path.motion.q)
    arm = load_robot("katana450-tilting").with_frames(base=Frame())
    drawn = draw(tool_poses(arm, Motion(path.motion.q)), **names["frame"])
    clockwise = bool(np.median(path.poses[:, :3, 2] @ normal) > 0)
    picture = scan(drawn, 0.1, clockwise=clockwise, rng=np.random.default_rng(0), dpi=DOTS)
    Image.fromarray(picture).save("scan.png")
    np.savetxt("potentiometer.txt", drawn.extension)
    exec(read, names)
    assert "1.0 mm" in capsys.readouterr().out

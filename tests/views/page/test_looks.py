"""A broken page is noticed: its words tab by tab, and the coarse picture of its scene, against those kept.

What is meant to be another page is kept anew:

    WORKBENCH_LOOKS=keep python -m pytest tests/views/page/test_looks.py
"""

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

from workbench.session.state import Tab
from workbench.views.page.camera import aim
from workbench.views.page.first_view import first_view

pytestmark = pytest.mark.browser

KEPT = Path(__file__).with_name("looks.json")
CELLS, CELL = (12, 16), 10
"""Rows and columns of the coarse picture, and pixels of a cell."""
ON_AVERAGE, ANYWHERE = 4.0, 60.0
"""How far colours may be off, of 255."""
NEVER_SAID = ("traceback", "error:", "nan", "undefined", "none", "[object")


@pytest.fixture(scope="module")
def known():
    return json.loads(KEPT.read_text(encoding="utf-8"))


def words_of(screen, tab: str) -> list[str]:
    """Lines of the whole page with this tab open, numbers left out."""
    screen.tab(tab)
    screen.page.wait_for_timeout(250)
    lines = screen.page.locator("body").inner_text().splitlines()
    words = (re.sub(r"[\d.,−+-]*\d", "#", line).strip() for line in lines if "WebGL" not in line)
    return [line for line in words if line]


def picture_of(screen) -> np.ndarray:
    """Mean colours of the scene's parts, from where it is seen first."""
    aim(screen.client, *first_view(screen.app.worker.session))
    screen.page.wait_for_timeout(500)
    pixels = screen.client.get_render(CELLS[0] * CELL, CELLS[1] * CELL, timeout=30.0)[..., :3].astype(float)
    return pixels.reshape(CELLS[0], CELL, CELLS[1], CELL, 3).mean((1, 3))


def off(now: np.ndarray, then: np.ndarray) -> tuple[float, float]:
    """Mean and greatest distance of two pictures' colours."""
    apart = np.abs(now - then)
    return float(apart.mean()), float(apart.max())


def test_words_and_scene_are_those_kept(app, look):
    screen = look()
    now = {"words": {tab: words_of(screen, tab) for tab in Tab}, "scene": picture_of(screen).round().tolist()}
    if os.environ.get("WORKBENCH_LOOKS") == "keep":
        KEPT.write_text(json.dumps(now, ensure_ascii=False, indent=0) + "\n", encoding="utf-8")
    then = json.loads(KEPT.read_text(encoding="utf-8"))
    for tab in Tab:
        assert now["words"][tab] == then["words"][tab], f"the tab {tab} reads otherwise; see {__file__}"
    mean, most = off(np.array(now["scene"]), np.array(then["scene"]))
    assert mean < ON_AVERAGE, f"the scene looks otherwise; see {__file__}"
    assert most < ANYWHERE, f"a part of the scene looks otherwise; see {__file__}"


def test_a_scene_without_its_arm_or_a_tab_without_words_would_be_noticed(known):
    scene = np.array(known["scene"])
    sky = np.broadcast_to(scene[0, 0], scene.shape)
    assert off(sky, scene)[0] > ON_AVERAGE or off(sky, scene)[1] > ANYWHERE
    assert np.ptp(scene, axis=(0, 1)).max() > ANYWHERE
    for tab in Tab:
        lines = known["words"][tab]
        assert len(lines) > 12
        assert not [line for line in lines if any(bad in line.lower().split() for bad in NEVER_SAID)]

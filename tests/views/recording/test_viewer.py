"""The viewer itself, without a window: it draws the sample, and a session while it goes on."""

import io
import os
import time
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from tests.views.recording.viewer import picture, viewer
from workbench.session import Worker
from workbench.session.commands.drag import SelectTarget
from workbench.views.recording.recorder import recorder

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def screen():
    if not list(Path("/usr/share/vulkan/icd.d").glob("*.json")):
        if os.environ.get("CI", "").lower() == "true":
            pytest.fail("no Vulkan driver: install Debian's mesa-vulkan-drivers")
        pytest.skip("Debian's mesa-vulkan-drivers is not installed")
    with viewer() as (client, port):
        yield client, port


def test_the_sample_is_drawn_at_its_end(screen, sample, tmp_path):
    client, _ = screen
    content = picture(client, sample.folder / "session.rrd")
    state = client.get_state()
    shown = next(r for r in state.recordings if r.store_id == state.active_recording)
    assert (shown.current_timeline, shown.current_time) == ("step", len(sample.lines))
    assert [view.name for view in state.views if view.reports] == []
    if folder := os.environ.get("WORKBENCH_PICTURES"):
        (Path(folder) / "sample.png").write_bytes(content)
    image = matplotlib.image.imread(io.BytesIO(content), format="png")[..., :3]
    scene = image[80 : image.shape[0] // 2 + 150, : int(0.49 * image.shape[1])]
    orange = np.abs(scene - np.array([213, 94, 0]) / 255).max(-1) < 0.2
    sand = np.abs(scene - np.array([202, 168, 120]) / 255).max(-1) < 0.15
    assert orange.sum() > 200  # the calibrated arm, which is there at the end only
    assert sand.sum() > 200  # blocks that are reached


def test_a_session_streams_to_an_open_viewer(screen, sample):
    client, port = screen
    worker = Worker(sample.first, keepers=[recorder(None, live=f"127.0.0.1:{port}")])
    for target in (3, 5, 7):
        worker.submit(SelectTarget(target))
    worker.wait()
    worker.close()
    deadline = time.monotonic() + 60.0
    ends = []
    while 3 not in ends and time.monotonic() < deadline:
        recordings = [r for r in client.get_state().recordings if r.store_id.endswith(":session")]
        ends = [t.end for r in recordings for t in r.timelines if t.name == "step"]
        time.sleep(0.2)
    assert 3 in ends

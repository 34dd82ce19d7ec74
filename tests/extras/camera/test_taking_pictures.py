"""Pictures that appear in a watched folder: kept, refused with the reason, taken again, used."""

import shutil
import time
from dataclasses import dataclass

import numpy as np
import pytest
from refusals import mentions

from workbench.extras.camera.image_sources import PictureWatcher
from workbench.extras.camera.panels import _shown
from workbench.extras.camera.rig import read_rig
from workbench.extras.camera.session_commands import (
    BeginShooting,
    Capture,
    DropShot,
    EndShooting,
    Previews,
    Shot,
    TakeShot,
    UseShots,
)
from workbench.plate.plate_toml import load_plate
from workbench.session import Worker
from workbench.session.journal.codec import decode, encode
from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.restore import restore
from workbench.session.part import AbstractPart

cv2 = pytest.importorskip("cv2")


@dataclass(frozen=True)
class RealArm(AbstractPart):
    """An arm that reports its joints."""

    real_arm = "arm"


@pytest.fixture(scope="module")
def shots(aria, tmp_path_factory):
    """Four pictures of a board and their files, in a folder from which they are brought one by one."""
    from board_on_tool import photograph

    folder = tmp_path_factory.mktemp("taken")
    photograph(aria, np.zeros(6), folder, count=4, fine=1)
    return folder


def until(worker, holds):
    end = time.monotonic() + 60.0
    while not holds(worker.session):
        assert time.monotonic() < end, worker.session.page.messages
        time.sleep(0.02)
    return worker.session


def test_a_watched_folder(first, shots, tmp_path):
    worker = Worker(first)
    worker.add_view(PictureWatcher(worker, pause=0.02))
    try:
        files = (shots / "camera.toml").read_bytes(), (shots / "target.toml").read_bytes()
        worker.submit(BeginShooting(str(tmp_path), *files))
        (tmp_path / "0.png").write_bytes((shots / "0.png").read_bytes())
        session = until(worker, lambda s: (c := s.part(Capture)) is not None and c.last is not None)
        assert not session.part(Capture).kept
        assert "its joints are unknown" in _shown(session.part(Capture))
        (tmp_path / "joints.csv").write_text((shots / "joints.csv").read_text())
        session = until(worker, lambda s: len(s.part(Capture).kept) == 1)
        assert session.part(Capture).kept[0].blur < 2.0
        blurred = cv2.GaussianBlur(cv2.imread(str(shots / "1.png"), 0), (0, 0), 5.0)
        cv2.imwrite(str(tmp_path / "1.png"), blurred)
        session = until(worker, lambda s: s.part(Capture).last.name == "1.png")
        assert len(session.part(Capture).kept) == 1
        assert "blurred by" in session.part(Capture).last.refused
        for k in (1, 2, 3):
            (tmp_path / f"{k}.png").write_bytes((shots / f"{k}.png").read_bytes())
        session = until(worker, lambda s: len(s.part(Capture).kept) == 4)
        assert "% of the picture used" in _shown(session.part(Capture))
        worker.submit(UseShots())
        session = until(worker, lambda s: s.measurements.loaded is not None)
    finally:
        worker.close()
    assert session.part(Capture) is None
    assert len(session.measurements.loaded.dataset) == 4
    assert len(session.part(Previews).by_image) == 4


def test_shots_are_written_down_taken_again_and_refused(do, shots):
    files = (shots / "camera.toml").read_bytes(), (shots / "target.toml").read_bytes()
    shot = Shot("a.png", "cell", b"jpeg", (0, 1, 2, 3), (0, 0, 0, 0), ((1.0, 2.0),) * 4, q=(0.0,) * 6)
    written, inputs = encode(TakeShot(shot))
    assert decode("TakeShot", written, inputs.__getitem__) == TakeShot(shot)
    assert "no pictures are being taken" in do(EndShooting(), TakeShot(shot)).page.messages[-1].text
    assert len(do(BeginShooting("here", *files), TakeShot(shot), TakeShot(shot)).part(Capture).kept) == 1
    assert mentions(do(UseShots()).page.messages[-1].text, "at least 4")
    assert not do(DropShot()).part(Capture).kept
    assert mentions(do(TakeShot(Shot("b.png", "cell", b"", q=(0.0, 0.0)))).page.messages[-1].text, "2 joints")


def test_a_recording_of_pictures_that_are_being_taken_opens_again(aria, shots, tmp_path):
    files = (shots / "camera.toml").read_bytes(), (shots / "target.toml").read_bytes()
    shot = Shot("a.png", "cell", b"jpeg", (0, 1, 2, 3), (0, 0, 0, 0), ((1.0, 2.0),) * 4, q=(0.0,) * 6)
    begun = begin(aria, load_plate("table2"), folder=tmp_path / "kept")
    worker = Worker(begun.session, keepers=begun.keepers, journal=begun.entries)
    worker.submit(BeginShooting("here", *files))
    worker.submit(TakeShot(shot))
    assert worker.wait(60.0)
    worker.close()
    again = restore(read_recording(tmp_path / "kept")).session.part(Capture)
    assert (again.source, again.kept) == ("here", (shot,))
    assert again.rig.cameras[0].size == read_rig(shots / "camera.toml", shots / "target.toml").cameras[0].size


def test_a_device(first, shots, tmp_path):
    """A sequence of pictures that OpenCV opens like a camera: each pose is kept once, when it is still."""
    for frame, k in enumerate((0, 0, 0, 1, 1, 2, 2, 3, 3)):
        shutil.copy(shots / f"{k}.png", tmp_path / f"{frame}.png")
    live = first.with_part(RealArm()).with_playback(jogged=np.full(6, 0.1))
    worker = Worker(live)
    worker.add_view(PictureWatcher(worker, pause=0.005))
    try:
        files = (shots / "camera.toml").read_bytes(), (shots / "target.toml").read_bytes()
        worker.submit(BeginShooting(f"device:{tmp_path / '%d.png'}", *files))
        session = until(worker, lambda s: any("stopped delivering" in m.text for m in s.page.messages))
        assert [shot.name for shot in session.part(Capture).kept] == ["2.png", "5.png", "7.png", "9.png"]
        assert session.part(Capture).kept[0].q == (0.1,) * 6
        worker.submit(EndShooting())
        worker.submit(BeginShooting(f"device:{tmp_path / 'none.avi'}", *files))
        until(worker, lambda s: "can't be opened" in s.page.messages[-1].text)
    finally:
        worker.close()

"""Folders of what cameras saw in a session: read, identified, saved, refused, and read again by a replay."""

import shutil

import camera_arms as virtual
import numpy as np
import pytest

from workbench.arm.robot_toml import read_toml
from workbench.extras.camera.folder import packed
from workbench.extras.camera.session_commands import LoadPictures
from workbench.plate.measured_plate import load_plate
from workbench.session import Worker
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.identify import Identify
from workbench.session.export import calibrated_urdf
from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.replay import restore
from workbench.session.page_state import Severity
from workbench.session.state import Focus


@pytest.fixture(scope="module")
def shots():
    rng, arm = virtual.made(3, "hobby", zeros=virtual.MIDDLE)
    return virtual.scene(rng, arm, 18)


@pytest.fixture
def folder(shots, tmp_path):
    place = tmp_path / "shots"
    place.mkdir()
    files = {
        "corners.csv": shots.table(),
        "where.csv": shots.joints(),
        "camera.toml": virtual.camera_toml(),
        "target.toml": virtual.target_toml("tool"),
    }
    for name, text in files.items():
        (place / name).write_text(text)
    return place


@pytest.fixture(scope="module")
def hobby(tmp_path_factory):
    path = tmp_path_factory.mktemp("hobby") / "hobby.toml"
    path.write_text(virtual.robot_toml("hobby"))
    return read_toml(path)


def test_a_folder_to_a_calibrated_urdf_and_again_by_its_journal(folder, hobby, tmp_path, shots):
    begun = begin(hobby, load_plate("table2"), folder=tmp_path / "kept")
    worker = Worker(begun.session, keepers=begun.keepers)
    try:
        worker.submit(LoadPictures("shots.zip", packed(folder)))
        assert worker.wait(60.0)
        first = worker.session
        assert first.measurements.loaded is not None
        assert "18 of 18 show" in dict(first.measurements.loaded.facts)["Pictures"]
        assert first.playback.focus is Focus.ROW
        for command in (Identify(("opt2",)), ShowRow(3), Diagnose()):
            worker.submit(command)
            assert worker.wait(120.0)
        session = worker.session
    finally:
        worker.close()
    assert "pictures can't be diagnosed" in session.page.messages[-1].text
    identifiability = session.results.identification.identifiability
    assert identifiability.title == "joint zeros"
    found = identifiability.json(session.results.run.fit)["camera"]["poses"]["camera[c0]"]
    assert np.linalg.norm(found["xyz"] - shots.camera[0][:3, 3]) < 0.005
    assert b"<robot" in calibrated_urdf(session)[1]
    again, loaded = restore(read_recording(tmp_path / "kept")).session, session.measurements.loaded
    assert again.measurements.loaded.dataset.source == loaded.dataset.source == loaded.name
    x, y = (each.results.identification.best.fit.x for each in (again, session))
    assert x == pytest.approx(y, rel=1e-9)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda f: (f / "target.toml").unlink(), "has no target.toml"),
        (lambda f: (f / "where.csv").unlink(), "has no joints"),
        (lambda f: (f / "corners.csv").unlink(), "has no pictures"),
        (lambda f: shutil.copy(f / "where.csv", f / "more.csv"), "several files of the same kind"),
    ],
)
def test_what_a_folder_lacks_is_said_in_one_sentence(folder, do, spoil, message):
    spoil(folder)
    session = do(LoadPictures("shots.zip", packed(folder)))
    assert session.measurements.loaded is None
    assert session.page.messages[-1].severity is Severity.ERROR
    assert message in session.page.messages[-1].text
    assert "/tmp" not in session.page.messages[-1].text

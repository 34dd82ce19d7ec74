"""A plate that was tried is not tried again when its recording is opened."""

import numpy as np

from workbench.extras.production.session import TryPlate
from workbench.session import Worker
from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.restore import restore


def test_a_trial_is_taken_from_the_journal(first, tmp_path, monkeypatch):
    begun = begin(first.robot, first.plate, folder=tmp_path / "r")
    worker = Worker(begun.session, keepers=begun.keepers)
    worker.submit(TryPlate(arms=5))
    assert worker.wait(120.0)
    worker.close()
    tried = worker.session.tried
    monkeypatch.setattr(TryPlate, "compute", lambda self, session: 1 / 0)
    restored = restore(read_recording(tmp_path / "r"))
    again = restored.session.tried
    assert not restored.differences
    assert (again.arms, again.share, again.text) == (tried.arms, tried.share, tried.text)
    assert np.array_equal(again.errors, tried.errors, equal_nan=True)

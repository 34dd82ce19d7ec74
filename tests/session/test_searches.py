"""Diagnoses that can't be made are refused in words; plates are improved."""

import json
import threading
from dataclasses import replace
from functools import partial

import numpy as np
from refusals import mentions

from workbench import optimise_plate
from workbench.base.types import Outcome
from workbench.plate.optimiser.result import PlateDesign
from workbench.session.commands.drag import MoveTarget, plain
from workbench.session.commands.edit import LockTarget
from workbench.session.commands.plate import ImprovePlate
from workbench.session.journal import codec
from workbench.session.page_state import Severity


def test_improving_can_be_cancelled_and_puts_in_only_what_is_better(
    do, worker, first, monkeypatch, short_polish
):
    quick = partial(optimise_plate, places=150, starts=1)
    monkeypatch.setattr("workbench.plate.design.optimise_plate", quick)
    worker.submit(ImprovePlate())
    while worker.session.page.job is None or not worker.session.page.job.text:
        threading.Event().wait(0.01)
    worker.cancel()
    assert worker.wait(60.0)
    assert worker.session.plate is first.plate
    assert "cancelled" in worker.session.page.messages[-1].text
    locked = range(2, 10)
    kept = do(*(LockTarget(i, True) for i in locked), ImprovePlate())
    assert kept.score.position < first.score.position
    assert np.array_equal(kept.plate.poses[locked], first.plate.poses[locked])

    def improved(session, plate):
        return ImprovePlate().finish(session, (first.plate, plate, ""))

    half = first.plate.targets[:5]
    kept_as = improved(first, replace(first.plate, targets=(*half, *half)))
    assert kept_as.plate is first.plate is kept_as.history.searched
    better = improved(first, kept.plate)
    assert better.history.searched is better.plate
    lower = replace(kept.plate, xyz=kept.plate.xyz - [0.0, 0.0, 0.05])
    told = improved(first, lower).page.messages[-1]
    assert (told.severity, mentions(told.text, "50 mm")) == (Severity.INFO, True)
    moved = MoveTarget(1, plain(first.plate.targets[1].xyz + 0.01), (-2.6, 0.0, 0.0)).apply(first)
    same = tuple(map(replace, moved.plate.targets))  # equal, and other objects
    both = improved(replace(moved, plate=replace(moved.plate, targets=same)), kept.plate).plate.targets
    assert (both[0], both[1]) == (kept.plate.targets[0], same[1])
    assert improved(moved, lower).plate is moved.plate
    assert better.score.position < first.score.position

    # a search that is cut short, which another machine would not do in the same place: its plate stays
    cut = ImprovePlate().stopped((first.plate, kept.plate, ""))
    read = codec.decode("ImprovePlate", json.loads(json.dumps(codec.encode(cut)[0])), bytes)
    after = read.finish(first, read.compute(first))
    assert np.array_equal(after.plate.poses, better.plate.poses)
    assert mentions(after.page.messages[-1].text, "cancelled")
    assert after.history.searched is None
    assert cut.finish(better, cut.compute(better)).plate is better.plate
    unfinished = PlateDesign(plate=lower, cost=2.0, rotation=0.0, start_cost=2.0, outcome=Outcome.CANCELLED)
    monkeypatch.setattr("workbench.plate.design.optimise_plate", lambda *_, **__: unfinished)
    assert cut.stopped(ImprovePlate().compute(first)) is None

"""What makes no sense is refused: one sentence without our folders, and the session stands."""

import numpy as np
import pytest

from workbench.session.commands.arm import ChooseRobot, Jog, LoadModel
from workbench.session.commands.compare import SetOverlay, ShowRow
from workbench.session.commands.data import ForgetData, LoadData, MeasureVirtualArm
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.drag import MoveTarget
from workbench.session.commands.identify import Identify, LeaveRowsOut
from workbench.session.commands.plate import SetNoise
from workbench.session.commands.region import SetRegion, ShowCubes
from workbench.session.comparison import Overlay
from workbench.session.journal import Ending
from workbench.session.page_state import Severity
from workbench.session.state import CubeView

RPY = (-2.6, 0.0, 0.0)
LOW, HIGH = (0.1, 0.1, 0.1), (0.5, 0.5, 0.4)
POINTS = b"q1[rad],q2[rad],q3[rad],q4[rad],q5[rad],q6[rad],x[m],y[m],z[m]\n" + 3 * b"0,0,0,0,0,0,1,1,1\n"

NONSENSE = {
    "place-nan": MoveTarget(0, (np.nan, 0.0, 0.0), RPY),
    "place-far": MoveTarget(0, (0.0, 0.0, 1e30), RPY),
    "no-target": MoveTarget(12, (0.1, 0.1, 0.1), RPY),
    "noise-zero": SetNoise(0.0, 1e-3),
    "region-inverted": SetRegion((0.5, 0.1, 0.1), (0.1, 0.5, 0.4), 0.1),
    "cubes-many": SetRegion(LOW, HIGH, 0.001),
    "region-far": SetRegion(LOW, (30.0, 0.5, 0.4), 0.1),
    "field-unmeasured": ShowCubes(CubeView(field="measured")),
    "too-early-identify": Identify(),
    "too-early-diagnose": Diagnose(),
    "too-early-row": ShowRow(0),
    "too-early-forget": ForgetData(),
    "no-algorithm": Identify(()),
    "overlay": SetOverlay(Overlay(exaggeration=0.0)),
    "joint-far": Jog((99.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    "joints-few": Jog((0.0, 0.0, 0.0)),
    "arm": ChooseRobot("no-such-arm"),
    "errors-large": MeasureVirtualArm(1, errors=(1e-3, 1.0)),
    "data-picture": LoadData("picture.png", b"\x89PNG\r\n\x1a\n" + bytes(50)),
    "data-words": LoadData("words.csv", b"hello, world\nthis, is no table\n"),
    "data-units": LoadData("units.csv", b"q1,q2,q3,q4,q5,q6,x[mm],y[mm],z[mm]\n1,2,3,4,5,6,7,8,9\n"),
    "data-joints": LoadData(
        "five.csv", b"q1[rad],q2[rad],q3[rad],q4[rad],q5[rad],x[m],y[m],z[m]\n" + b"0," * 7 + b"1\n"
    ),
    "data-large": LoadData("big.csv", bytes(21 * 2**20)),
    "model-words": LoadModel("a.toml", b"nonsense ="),
    "model-kind": LoadModel("a.pdf", b"%PDF"),
    "model-large": LoadModel("a.toml", b" " * 3_000_000),
}


@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_is_refused_and_the_session_stands(worker, do, first, name):
    session = do(NONSENSE[name])
    message = session.page.messages[-1]
    assert message.severity is Severity.ERROR
    assert "/tmp" not in message.text
    assert "is unchanged" not in message.text
    assert worker.journal[-1].ending is (Ending.DONE if session.measurements.unread else Ending.REFUSED)
    for part in ("robot", "plate", "selected", "noise", "playback", "results"):
        assert getattr(session, part) is getattr(first, part), part
    assert session.measurements.loaded is None


@pytest.mark.parametrize(
    "commands",
    [
        (LoadData("few.csv", POINTS), Identify()),
        (MeasureVirtualArm(3), LeaveRowsOut(tuple(range(9))), Identify(("ols",))),
        (MeasureVirtualArm(5), Diagnose()),
        (MeasureVirtualArm(5), LeaveRowsOut((77,))),
    ],
    ids=["identify", "left-out", "diagnose", "no-row"],
)
def test_too_few_rows_are_refused(do, commands):
    session = do(*commands)
    assert session.page.messages[-1].severity is Severity.ERROR
    assert session.results.identification is session.results.diagnosis is None
    assert session.measurements.loaded is not None

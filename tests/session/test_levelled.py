"""What is said of the instrument's z axis reaches every fit."""

from tests.session.direct_commands import done
from workbench.plate.plate_toml import write_plate
from workbench.session.commands.arm import LoadModel
from workbench.session.commands.data import ForgetData, MeasureVirtualArm
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.identify import Identify, SetLevelled
from workbench.session.commands.sessions import MakeSession


def test_fits_know_whether_the_instrument_is_levelled(first):
    session = done(first, MeasureVirtualArm(3, more=20))
    for levelled in (False, True):
        found = done(session, SetLevelled(levelled), Identify(("opt2",)), Diagnose())
        assert found.results.identification.best.fit.problem.frames.levelled is levelled
        assert found.results.diagnosis.final_fit.problem.frames.levelled is levelled


def test_it_is_said_of_these_measurements(first):
    session = done(first, MeasureVirtualArm(3), SetLevelled(True))
    assert done(session, MakeSession(4)).measurements.levelled
    assert not done(session, ForgetData()).measurements.levelled


def test_another_plate_leaves_what_is_known_of_the_measurements(first, tmp_path):
    """The box was cleared, and the next fit was another one."""
    content = write_plate(first.plate, tmp_path / "other.toml").read_bytes()
    session = done(first, MeasureVirtualArm(3), SetLevelled(True), LoadModel("other.toml", content))
    assert session.measurements.loaded is not None
    assert session.measurements.levelled

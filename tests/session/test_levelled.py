"""What is said of the instrument's z axis reaches every fit."""

from tests.session.direct_commands import done
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.identify import Identify, SetLevelled


def test_fits_know_whether_the_instrument_is_levelled(first):
    session = done(first, MeasureVirtualArm(3, more=20))
    for levelled in (False, True):
        found = done(session, SetLevelled(levelled), Identify(("opt2",)), Diagnose())
        assert found.results.identification.best.fit.problem.frames.levelled is levelled
        assert found.results.diagnosis.final_fit.problem.frames.levelled is levelled

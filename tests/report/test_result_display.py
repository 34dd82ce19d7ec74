"""Results say what they show, themselves or by their report."""

import subprocess
import sys

import pytest

REGISTERED = """
import workbench as wb
from workbench.report import result_display as display

def below(kind):
    return {kind}.union(*map(below, kind.__subclasses__()))

verb = getattr(wb, "VERB")
pairs = ((display.AbstractReported, display.summary_of), (display.AbstractPlotted, display.plot_of))
for base, shown in pairs:
    kinds = [k for k in below(base) if not k.__name__.startswith("Abstract")]
    assert kinds
    assert not [k for k in kinds if shown.dispatch(k) is shown.dispatch(object)], kinds
"""


@pytest.mark.parametrize("verb", ["identify", "evaluate", "diagnose", "score", "optimise_plate"])
def test_a_verb_brings_the_report_of_its_results(verb: str):
    done = subprocess.run(
        [sys.executable, "-c", REGISTERED.replace("VERB", verb)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr

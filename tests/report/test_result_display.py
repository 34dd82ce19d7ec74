"""Results say what they show, themselves or by their report."""

import subprocess
import sys

REGISTERED = """
import os
import scipy.optimize
import workbench as wb
from workbench.report.result_display import AbstractReported, blocks_of

def below(kind):
    return {kind}.union(*map(below, kind.__subclasses__()))

for verb in ("identify", "evaluate", "diagnose", "score", "optimise_plate"):
    if child := os.fork():
        assert os.waitpid(child, 0)[1] == 0, verb
        continue
    getattr(wb, verb)
    kinds = [k for k in below(AbstractReported) if not k.__name__.startswith("Abstract")]
    assert kinds
    assert not [k for k in kinds if blocks_of.dispatch(k) is blocks_of.dispatch(object)], kinds
    break
"""


def test_a_verb_brings_the_report_of_its_results():
    done = subprocess.run([sys.executable, "-c", REGISTERED], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr

"""What benchmarks find beside them: the tests, whose arms and judges they share, and the measured data."""

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TESTS = Path(__file__).resolve().parents[1]
DATA = TESTS.parents[1] / "shared" / "data"
sys.path[:0] = [str(TESTS.parent), str(TESTS), str(TESTS / "diagnosis")]

"""Tables read wrongly, found out by three poses of the pendant.  Run: tests/benchmarks/own_robot.py [COUNT]

Each of COUNT (200) choices takes one of five arms (DH, Hayati, modified DH; five to seven joints). Its
pendant counts three joints in ten the other way, from quarter turns or from anywhere; its table is in m or
mm, rad or deg; its poses have one of three kinds of angles, all rounded as pendants do. Printed: how many are
found, how many refused with what would decide, how many silently wrong (must be 0), and the processor's time.
"""

import statistics
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "arm"))
from test_own_robot import ARMS, right, wrong_choice

from workbench.arm.own_robot.find_convention import find_convention
from workbench.arm.own_robot.readings import table_readings, typed_readings
from workbench.base.errors import DataError


def main(count: int) -> None:
    tally: Counter[str] = Counter()
    seconds = []
    for number in range(count):
        name = ARMS[number % len(ARMS)]
        arm, signs, offsets, table, numbers = wrong_choice(np.random.default_rng(1000 + number), name)
        start = time.process_time()
        try:
            found = find_convention(table_readings(table), typed_readings(numbers, [False] * arm.dof))
        except DataError as error:
            result = "refused"
            print(number, name, error)
        else:
            result = "right" if right(found, arm, signs, offsets) else "WRONG"
            if result == "WRONG":
                print(number, name, found.text, found.changes)
        seconds.append(time.process_time() - start)
        tally[result] += 1
        if number % 10 == 9:
            print(dict(tally), flush=True)
    middle, most = statistics.median(seconds), max(seconds)
    print(f"{dict(tally)} of {count}; median {middle:.1f} s, most {most:.1f} s of the processor")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)

"""Options of a run over kinds of virtual arms and seeds."""

import argparse
import fnmatch
from collections.abc import Collection, Sequence

from arms import seeds_of


def run_options(
    about: str, what: str, known: Collection[str], *, arms: int, arguments: Sequence[str] | None = None
) -> argparse.Namespace:
    """The options, `kinds` and `seeds` as lists.

    Args:
        about: What the run does.
        what: What a kind is called; the option that chooses some of them.
        known: All kinds.
        arms: How many arms by default.
        arguments: In place of those of the command line.
    """
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument(f"--{what}", default=",".join(known), help=f"{what}, commas between", dest="kinds")
    parser.add_argument("--arms", type=int, default=arms, help="how many, one a seed")
    parser.add_argument("--seeds", default="tuning", help="tuning, judging, or the first and the end: 5:8")
    parser.add_argument("--wrong", action="store_true", help="list what was missed or falsely named")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    given = parser.parse_args(arguments)
    asked = [fnmatch.filter(known, kind) or [kind] for kind in given.kinds.split(",")]
    given.kinds = [kind for some in asked for kind in some]
    if strange := set(given.kinds) - set(known):
        parser.error(f"--{what} doesn't know {', '.join(sorted(strange))}; choose from {', '.join(known)}")
    given.seeds = seeds_of(given.seeds, given.arms)
    return given

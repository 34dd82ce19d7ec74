"""Options of a run over kinds of virtual arms and seeds, and how it ends."""

import argparse
import fnmatch
from collections.abc import Callable, Collection, Iterable

from arms import seeds_of


def some_of(known: Collection[str], **groups: Collection[str]) -> Callable[[str], list[str]]:
    """What reads names or patterns, commas between; a group is several by one word."""

    def chosen(text: str) -> list[str]:
        asked = [groups.get(name) or fnmatch.filter(known, name) or [name] for name in text.split(",")]
        if strange := {name for some in asked for name in some} - set(known):
            choice = ", ".join([*known, *groups])
            raise argparse.ArgumentTypeError(f"unknown: {', '.join(sorted(strange))}; choose from {choice}")
        return [name for some in asked for name in some]

    return chosen


def run_options(about, what, known, *, arms, arguments=None, own=()) -> argparse.Namespace:
    """The options, `kinds` and `seeds` as lists.

    Args:
        about: What the run does.
        what: What a kind is called; the option that chooses some of them.
        known: All kinds.
        arms: How many arms by default.
        arguments: In place of those of the command line.
        own: Parsers of further options.
    """
    parser = argparse.ArgumentParser(description=about, parents=own)
    parser.add_argument(f"--{what}", default="*", type=some_of(known), help="commas between", dest="kinds")
    parser.add_argument("--arms", type=int, default=arms, help="how many, one a seed")
    parser.add_argument("--seeds", default="tuning", help="tuning, judging, or the first and the end: 5:8")
    parser.add_argument("--wrong", action="store_true", help="list what was missed or falsely named")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    given = parser.parse_args(arguments)
    given.seeds = seeds_of(given.seeds, given.arms)
    return given


def ended(given: argparse.Namespace, checks: Iterable[tuple[str, bool]]) -> int:
    """The exit status, after each bound and whether it holds."""
    checks = list(checks)
    for text, holds in checks:
        print(f"{'✓' if holds else '✗'} {text}")
    return int(given.check and not all(holds for _, holds in checks))

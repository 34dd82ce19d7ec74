"""Results of long runs, written line by line: a run that was interrupted goes on where it stopped.

The first line says which sources made them; results of other sources are never mixed with them.
"""

import argparse
import hashlib
import json
from collections.abc import Collection, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("workbench", "tests/diagnosis")


def fingerprint() -> str:
    """Of the package and of what judges it."""
    digest = hashlib.sha256()
    for path in sorted(p for folder in SOURCES for p in (ROOT / folder).rglob("*.py")):
        digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:12]


class Ledger:
    """Records by key, in a file of one JSON pair a line.

    Args:
        path: Where they are kept; None: in memory only.
        about: What else must be the same for records to be of one run.
    """

    def __init__(self, path: Path | None, about: str = ""):
        self._path, self.records = path, {}
        head = ["sources", f"{fingerprint()} {about}".strip()]
        if path is None:
            return
        pairs = _pairs(path) if path.exists() else []
        if pairs and pairs[0] != head:
            raise SystemExit(
                f"{path} holds results of other sources or options ({pairs[0][1]}, now {head[1]}); "
                "give another --json, or remove it"
            )
        self.records = dict(pairs[1:])
        path.write_text("".join(f"{json.dumps(p)}\n" for p in [head, *self.records.items()]))

    def __contains__(self, key: str) -> bool:
        return key in self.records

    def add(self, key: str, record: dict) -> None:
        """Keep one more."""
        self.records[key] = record
        if self._path is not None:
            with self._path.open("a") as file:
                file.write(f"{json.dumps([key, record], ensure_ascii=False)}\n")


def _pairs(path: Path) -> list[list]:
    """All whole lines; the last may be torn."""
    out = []
    for line in path.read_text().splitlines():
        try:
            out.append(json.loads(line))
        except json.JSONDecodeError:
            break
    return out


def run_options(
    about: str, what: str, known: Collection[str], *, arms: int, arguments: Sequence[str] | None = None
) -> argparse.Namespace:
    """Options of a run over kinds and seeds.

    Args:
        about: What the run does.
        what: What a kind is called; the option that chooses some of them.
        known: All kinds.
        arms: How many arms by default.
        arguments: In place of those of the command line.
    """
    from arms import seeds_of

    parser = argparse.ArgumentParser(description=about)
    parser.add_argument(f"--{what}", default=",".join(known), help=f"{what}, commas between", dest="kinds")
    parser.add_argument("--arms", type=int, default=arms, help="how many, one a seed")
    parser.add_argument(
        "--seeds", default="tuning", help="tuning, judging, or the first one and the end: 5:8"
    )
    parser.add_argument("--json", type=Path, help="keep every judged arm in this file, and go on from it")
    parser.add_argument("--wrong", action="store_true", help="list what was missed or falsely named")
    parser.add_argument("--check", action="store_true", help="exit status 1 if a bound is broken")
    given = parser.parse_args(arguments)
    given.kinds = given.kinds.split(",")
    if strange := set(given.kinds) - set(known):
        parser.error(f"--{what} doesn't know {', '.join(sorted(strange))}; choose from {', '.join(known)}")
    given.seeds = seeds_of(given.seeds, given.arms)
    return given

"""Findings: a printed number or statement beside what comes out here, and why they differ if they do."""

from collections import Counter
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from workbench.report.blocks import Block, ResultTable, Sentence


class Verdict(StrEnum):
    """How a printed number fares."""

    AGREES = "agrees"
    DIFFERS = "differs"
    HOLDS = "holds (not counted)"
    FAILS = "fails (not counted)"
    NONE = "none can be given"


GOOD = (Verdict.AGREES, Verdict.HOLDS)
"""Verdicts that need no reason."""
NOTHING_TO_MEET = ("–", "(", "≤", "≥", "<", ">", "up to", "at least", "at most")
"""How a printed cell begins where it is empty, implied or a bound, which many numbers keep."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One printed number or statement.

    Args:
        where: Table, figure, equation or section of the work.
        what: What it says something about, with its unit.
        printed: As printed.
        here: What comes out here; a dash where nothing can.
        verdict: Whether the two agree.
        reason: Why they differ or nothing can be given, or what makes them agree; may be empty.
    """

    where: str
    what: str
    printed: str
    here: str
    verdict: Verdict
    reason: str = ""


def between(low: float, high: float, form: str = "g") -> str:
    """A range for people, one number where both ends read alike."""
    ends = f"{low:{form}}", f"{high:{form}}"
    return " to ".join(dict.fromkeys(ends))


def judged(
    where: str, what: str, printed: str, here: str, agrees: bool | np.bool_, reason: str = ""
) -> Finding:
    """A printed result that agrees or not.

    Numbers over several arms agree if the interval of nine arms in ten encloses the printed one, single
    numbers if they round to it, statements if the numbers beside them bear them out. Where nothing is printed
    (a dash, or words in brackets) or a bound is, there is nothing to agree with: see `checked`.
    """
    if printed.startswith(NOTHING_TO_MEET):
        return checked(where, what, printed, here, agrees, reason)
    verdict = Verdict.AGREES if agrees else Verdict.DIFFERS
    return Finding(where=where, what=what, printed=printed, here=here, verdict=verdict, reason=reason)


def checked(
    where: str, what: str, printed: str, here: str, holds: bool | np.bool_, reason: str = ""
) -> Finding:
    """A check: a value that was hidden or copied here, arithmetic on the work's own numbers, a bound."""
    verdict = Verdict.HOLDS if holds else Verdict.FAILS
    return Finding(where=where, what=what, printed=printed, here=here, verdict=verdict, reason=reason)


def without(where: str, what: str, printed: str, reason: str) -> Finding:
    """A printed number that nothing here can be set beside."""
    return Finding(where=where, what=what, printed=printed, here="–", verdict=Verdict.NONE, reason=reason)


def findings_json(work: str, findings: tuple[Finding, ...]) -> dict[str, Any]:
    """Every finding of a work, and how many have each verdict."""
    counts = Counter(finding.verdict for finding in findings)
    return {
        "schema": "workbench.reproduction/1",
        "work": work,
        "verdicts": {str(verdict): counts[verdict] for verdict in Verdict},
        "findings": [asdict(finding) for finding in findings],
    }


def findings_blocks(findings: tuple[Finding, ...]) -> list[Block]:
    """Printed numbers beside ours, and below why some differ."""
    rows = [(f.where, f.what, f.printed, f.here, str(f.verdict)) for f in findings]
    reasons: dict[str, list[str]] = {}
    for finding in findings:
        if finding.verdict not in GOOD:
            reasons.setdefault(finding.reason, []).append(f"{finding.where}, {finding.what}")
    table = ResultTable("", ("where", "what", "printed", "here", "verdict"), rows, words=5)
    return [table, *(Sentence(f"{'; '.join(which)}: {reason}") for reason, which in reasons.items())]

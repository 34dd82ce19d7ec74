"""Tables and bounds of the zoo: how diagnoses of virtual arms came out."""

from collections.abc import Iterator, Mapping, Sequence

from calibration import Bin, bins, expected_error
from cases import CASES, WITHOUT
from counts import NOTHING, Share, by_kind, confusion, share, shares, wilson
from judge import Judged
from rich.table import Column, Table

from workbench.arm.effects import EFFECTS

EACH, THREE, GOOD, ALARMS, FALSE, ODDS = 0.95, 0.85, 0.95, 0.02, 0.05, 0.05
"""Least share right of each kind, of three at once, and of good models; greatest share of arms without an
effect that are accused under a condition, of false causes per arm, and expected error of stated odds."""


def percent(part, whole) -> str:
    return f"{100 * part / whole:.0f} %" if whole else ""


def bounded(part, whole) -> str:
    """A share with its 95 % bounds."""
    low, high = wilson(part, whole)
    return f"{100 * part / whole:.0f} % ({100 * low:.0f}–{100 * high:.0f})" if whole else ""


def matrix(judged: Sequence[Judged], condition: str) -> Table:
    """True kinds by names given: cases with the right joint, and after + those with another."""
    names = [*EFFECTS, NOTHING]
    heads = (n.replace("-", "\n") for n in names)
    table = Table(Column("true \\ named", no_wrap=True), *heads, title=f"confusion, {condition}")
    for kind, row in confusion(judged).items():
        cells = (row.get(name, (0, 0)) for name in names)
        table.add_row(kind, *(f"{a or ''}{f'+{b}' if b else ''}" for a, b in cells))
    return table


def summary(judged: Sequence[Judged], condition: str) -> Table:
    """How every kind came out; what the rows can't show is left out of all but the first column."""
    heads = ("case", "arms", "right", "or in a class", "missed", "false on", "false/arm", "failed")
    table = Table(*heads, "good", "halved", "error / σ", "rows right", "seconds", title=f"cases, {condition}")
    requested = [j for j in judged if j.seen]
    rows = shares(requested) | {"all": share(requested)} if requested else {}
    for kind, s in rows.items():
        unseen = sum(j.kind == kind or kind == "all" for j in judged) - s.cases
        table.add_row(kind, f"{s.cases}{f' (+{unseen})' if unseen else ''}", *_cells(s, kind))
        if kind == list(rows)[-2]:
            table.add_section()
    return table


def _cells(s: Share, kind: str) -> Iterator[str]:
    yield bounded(s.right, s.cases)
    yield bounded(s.in_class, s.cases) if s.in_class > s.right else ""
    yield from (str(n or "") for n in (s.missed, s.extra))
    yield f"{s.false / s.cases:.2f}" if s.false else ""
    yield str(s.failed or "")
    yield bounded(s.good, s.cases)
    yield percent(s.halved, s.cases) if kind in CASES and CASES[kind].nameless else ""
    yield f"{s.error:.2f}"
    yield percent(s.rows, s.cases) if kind in CASES and CASES[kind].misseated else ""
    yield f"{s.seconds[0]:.1f} … {s.seconds[1]:.1f}"


def morphologies(judged: Sequence[Judged], condition: str) -> Table:
    """Share that is right on each morphology."""
    requested = [j for j in judged if j.seen]
    arms = list(dict.fromkeys(j.arm for j in requested))
    table = Table("right on", *arms, title=f"morphologies, {condition}")
    for kind, ones in (by_kind(requested) | {"all": requested}).items():
        each = ([j.right for j in ones if j.arm == arm] for arm in arms)
        table.add_row(kind, *(f"{sum(e)} of {len(e)}" if e else "" for e in each))
    return table


def under_conditions(calm: Mapping[str, Sequence[Judged]]) -> Table:
    """Arms without an effect: how many were accused of one."""
    table = Table(
        "condition", "arms", "accused", "of what", "failed", "good", "error / σ", "seconds", title="no effect"
    )
    for condition, ones in calm.items():
        s = share(ones)
        text = sorted({n.name for j in ones for n in (*j.found, *j.extra)})
        cells = (str(s.cases), bounded(s.named, s.cases), ", ".join(text), str(s.failed or ""))
        table.add_row(condition, *cells, bounded(s.good, s.cases), f"{s.error:.2f}", f"{s.seconds[0]:.1f}")
    return table


def compared(runs: Mapping[str, Sequence[Judged]]) -> Table:
    """How often each kind is right in several runs, and false causes per arm."""
    table = Table("right", *runs, title="ablation")
    seen = {name: [j for j in ones if j.seen] for name, ones in runs.items()}
    for kind in dict.fromkeys(j.kind for ones in seen.values() for j in ones):
        mine = ([j.right for j in ones if j.kind == kind] for ones in seen.values())
        table.add_row(kind, *(f"{sum(right)} of {len(right)}" for right in mine))
    table.add_section()
    table.add_row("all", *(percent(sum(j.right for j in ones), len(ones)) for ones in seen.values()))
    false = (sum(len(j.extra) for j in ones) / max(len(ones), 1) for ones in seen.values())
    table.add_row("false causes per arm", *(f"{rate:.2f}" for rate in false))
    odds = (bins([pair for j in ones for pair in j.odds]) for ones in seen.values())
    table.add_row("expected error of odds", *(f"{expected_error(o):.1%}" if o else "" for o in odds))
    return table


def bounds(
    judged: Mapping[str, Sequence[Judged]], calm: Mapping[str, Sequence[Judged]], odds: float | None
) -> Iterator[tuple[str, str, bool]]:
    """Sentences, values, and whether they hold."""
    ideal = by_kind(j for j in judged.get("ideal", ()) if j.seen)
    for kind, ones in ideal.items():
        minimum = THREE if kind == "three" else EACH
        right = sum(j.right for j in ones)
        if kind not in WITHOUT:
            yield f"{kind}: right ≥ {minimum:.0%}", bounded(right, len(ones)), right >= minimum * len(ones)
    named = [j for kind, ones in ideal.items() if kind not in WITHOUT for j in ones if not j.nameless]
    if named:
        good = sum(bool(j.good) for j in named)
        text = f"saved model within half of the noise ≥ {GOOD:.0%}"
        yield text, bounded(good, len(named)), good >= GOOD * len(named)
    for condition, ones in calm.items():
        if ones:
            alarms = sum(bool(j.found or j.extra) for j in ones)
            text = f"no effect, {condition}: accused ≤ {ALARMS:.0%}"
            yield text, f"{alarms} of {len(ones)}", alarms <= ALARMS * len(ones)
    every = [j for ones in (*judged.values(), *(o for c, o in calm.items() if c != "ideal")) for j in ones]
    if every:
        rate = sum(len(j.extra) for j in every) / len(every)
        yield f"false causes per arm ≤ {FALSE}", f"{rate:.3f}", rate <= FALSE
    off = [j for ones in judged.values() for j in ones if j.misseated]
    if off:
        rows = sum(j.rows_right for j in off)
        yield "misplaced rows found, ≤ 1 false", f"{rows} of {len(off)}", rows == len(off)
    if odds is not None:
        yield f"expected error of stated odds ≤ {ODDS:.0%}", f"{odds:.1%}", odds <= ODDS


def kept(found: Sequence[Bin]) -> Table:
    """Stated odds: how many claims state about what, and how many of these are true."""
    table = Table("stated", "claims", "true", "kept", title="stated odds")
    for b in found:
        table.add_row(f"{100 * b.stated:.4g} %", str(b.claims), str(b.true), bounded(b.true, b.claims))
    return table


def wrong(j: Judged) -> str:
    """One line on a case that is not right."""
    spoken = (
        ", ".join(_word(n) for n in group) or NOTHING
        for group in (j.truth, dict.fromkeys((*j.found, *j.extra)))
    )
    rows = f"; rows −{j.overlooked} +{j.accused}" if j.overlooked or j.accused else ""
    blind = "" if j.seen else ", can't be seen"
    errors = f"error {j.before:.2f} → {j.error:.2f} σ"
    return f"{j.kind} {j.arm} {j.seed}: {' → '.join(spoken)}{rows} ({j.verdict}, {errors}{blind})"


def _word(named) -> str:
    joints = "/".join(str(j + 1) for j in named.joints)
    return " ".join(str(w) for w in (named.name, joints, named.detail) if w not in ("", None))

"""What rows mean: the best of the readings that were found, and what these rows can't tell from it."""

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Int

from workbench.identification.meaning.placement import place
from workbench.identification.meaning.reading import RowReading, flange_poses
from workbench.identification.meaning.search import CLEAR, HANDED, ReadingSearch

ALIKE = 1.3
"""Ratio of misfits below which the simplest reading is taken."""
SAME = 0.01
"""Share of the reach within which two readings put the flange in one place."""
SHOWN = 6
"""Readings that are named in a list."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RowMeaning:
    """What rows mean: the best reading, and what these rows can't tell from it.

    Args:
        best: The simplest of the readings that fit best.
        plain: The rows as given.
        margin: How many times worse the next one is that moves otherwise.
        blind: Readings of the same points that say more than the best one does.
        equal: The best one and those of the same points that are as likely and mean other arms, of which a
            person has to choose; empty if there are none.
        open: Readings that these rows can't tell from it.
        tried: Number of candidates by family; empty if the rows fit as given.
        turned: The joints as given with other orientations, or poses inverted, if clearly theirs.
        parts: Which of rows that nothing explains fit the arm by themselves; `remedy`: what to do about that.
        kept: Numbers of the rows that fit, where the others don't and a column tells them; None otherwise.
        constant: What rows that nothing else explains fit with one constant of the arm's table changed.
    """

    best: RowReading
    plain: RowReading | None
    margin: float = np.inf
    blind: tuple[str, ...] = ()
    equal: tuple[RowReading, ...] = ()
    open: tuple[str, ...] = ()
    tried: dict[str, int] = field(default_factory=dict)
    turned: RowReading | None = None
    parts: str = ""
    remedy: str = "name what was moved in between in a column 'session', or correct the rows"
    kept: Int[np.ndarray, " k"] | None = None
    constant: str = ""

    @property
    def is_found(self) -> bool:
        """Whether the best reading fits and is clearly better than the rows as given and than any other."""
        if not self.best.fits:
            return False
        if self.best.is_plain or self.plain is None:
            return self.margin > 1.0
        return self.margin >= CLEAR and CLEAR * self.best.score < self.plain.score

    @property
    def choices(self) -> dict[str, RowReading]:
        """The equal readings, each by a change that no other has; else the best one, as `found`."""
        told = Counter(change for r in self.equal for change in r.changes)
        own = [next((c for c in r.changes if told[c] == 1), r.text).partition(" (")[0] for r in self.equal]
        return dict(zip(own, self.equal, strict=True)) or {"found": self.best}


def ranked(search: ReadingSearch, plain: RowReading | None) -> RowMeaning:
    """The simplest of the readings that fit alike; the others by what tells them from it."""
    found = sorted(search.found, key=lambda r: r.score)
    ties = [r for r in found if r.score < ALIKE * found[0].score + search.floor]
    ties += [r for r in found if r.is_plain and r.fits and r.score < CLEAR * found[0].score]
    best = min(ties, key=lambda r: (round(r.cost, 3), r.score))
    floor = max(best.score, search.floor)
    near = [r for r in found if r is not best and r.score < 4.0 * CLEAR * floor][:40]
    far = min((r.score for r in found if r is not best and r.score >= 4.0 * CLEAR * floor), default=np.inf)
    low, high = search.data.q.min(0), search.data.q.max(0)
    around = 1.0 / best.unit if search.held else 0.0
    q = np.random.default_rng(0).uniform(low - around, high + around, (24, len(low)))
    if search.held:
        off = {r: np.abs(best.flange(q) - r.flange(q)) for r in near if r.unit == best.unit}
        reach = SAME * best.robot.reach
        alike = [r for r, e in off.items() if e[..., 3].max() < reach and e[..., :3].max() < 4.0 * SAME]
    else:
        is_free = best.mirrored or not search.conventions  # no instrument mirrors poses
        near = [r for r in near if r.text != best.text and (is_free or not r.mirrored)]
        alike = [r for r in near if _same_motion(best, r, q)]
    unseen = [r for r in near if r not in alike and not search.held and r.score < CLEAR * floor]
    blind = [r for r in unseen if _same_points(best, r, q)]
    other = [r for r in near if r not in alike and r not in blind]
    equal = () if search.conventions else _equal(best, sorted(blind, key=lambda r: r.cost), q)
    meaning = RowMeaning(
        best=best,
        plain=plain,
        margin=min((r.score for r in other), default=far) / floor,
        blind=_texts([r for r in blind if r.mirrored <= best.mirrored and r not in equal]),
        equal=equal,
        open=_texts([r for r in other if r.score < CLEAR * floor]),
        tried=dict(search.tried),
        turned=search.turned,
    )
    is_turned = meaning.is_found and replace(best, inverse=False).is_plain and best.inverse
    return replace(meaning, turned=best) if is_turned else meaning


def _equal(best: RowReading, blind: list[RowReading], q: np.ndarray) -> tuple[RowReading, ...]:
    """Readings of the same points that mean other arms, without what only says more; none if one is left."""
    kept = [best]
    for r in blind:
        says_more = any({*k.changes} <= {*r.changes} for k in kept)
        if r.cost < best.cost + HANDED and not says_more and not any(_same_motion(k, r, q) for k in kept):
            kept.append(r)
    return tuple(kept[:SHOWN]) if len(kept) > 1 else ()


def _texts(readings: list[RowReading]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(r.text for r in readings))[:SHOWN]


def _same_motion(one: RowReading, other: RowReading, q: np.ndarray) -> bool:
    """Whether two readings move the flange alike at random postures, up to base and tool."""
    if (one.inverse, one.orientation, one.mirrored) != (other.inverse, other.orientation, other.mirrored):
        return False
    seen = flange_poses(one.robot, one.joints(q))[None]
    at = place(other.robot, other.joints(q)[None], seen[..., :3, 3], seen[..., :3, :3], robust=False)
    return bool(at.error.max() < 2e-4 * one.robot.reach and at.turn.max() < 2e-3)


def _same_points(one: RowReading, other: RowReading, q: np.ndarray) -> bool:
    """Whether two readings predict the same points of the file at random postures."""
    if one.inverse or other.inverse:
        return False
    tips = ((r.base @ flange_poses(r.robot, r.joints(q)) @ r.tool)[:, :3, 3] for r in (one, other))
    seen, own = (tip @ r.axes.T / r.scale for tip, r in zip(tips, (one, other), strict=True))
    error = one.scale * np.sqrt(((seen - own) ** 2).sum(1).mean())
    return bool(error < max(1.5 * max(one.position, other.position), 2e-4 * one.robot.reach))

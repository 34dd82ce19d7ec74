"""What rows mean: the best reading that was found, what these rows can't tell from it, and what to say."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from workbench.base.remedy import remedy as at_entrance
from workbench.identification.meaning.bounds import flange_poses
from workbench.identification.meaning.placement import place
from workbench.identification.meaning.reading import FOREIGN_MISFIT, RowReading
from workbench.identification.meaning.search import CLEAR, HANDED, ReadingSearch

ALIKE = 1.3
"""Ratio of misfits below which the simplest reading is taken."""
SAME = 0.01
"""Share of the reach within which two readings put the flange in one place."""
NEAR, SHOWN = 40, 6
"""Readings that are compared with the best one, and that are named in a list."""
SMALL_ZERO = 0.26
"""Zeros that differ by less [rad] are errors of the arm, which an identification finds."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RowMeaning:
    """What rows mean: the best reading, and what these rows can't tell from it.

    Args:
        best: The simplest of the readings that fit best.
        plain: The rows as given.
        margin: How many times worse the next one is that moves otherwise, and not only changes more.
        alike: Readings that move the arm alike.
        blind: Readings of the same points that say more than the best one does.
        equal: The best one and those of the same points that are as likely and mean other arms, of which a
            person has to choose; empty if there are none.
        open: Readings that these rows can't tell from it.
        tried: Number of hypotheses by family; empty if the rows fit as given.
        turned: The joints as given with other orientations, or poses inverted, if clearly theirs.
        told: Of rows that nothing explains, which fit the arm by themselves, or with which constant of its
            table changed all do; `cure`: what to do about those that don't.
        kept: Heading and value of the rows that fit, where the others don't and a column tells; else empty.
    """

    best: RowReading
    plain: RowReading | None
    margin: float = np.inf
    alike: tuple[str, ...] = ()
    blind: tuple[str, ...] = ()
    equal: tuple[RowReading, ...] = ()
    open: tuple[RowReading, ...] = ()
    tried: dict[str, int] = field(default_factory=dict)
    turned: RowReading | None = None
    told: str = ""
    cure: str = ""
    kept: tuple[str, ...] = ()

    @property
    def is_found(self) -> bool:
        """Whether the best reading fits and is clearly better than the rows as given and than any other."""
        if not self.best.fits:
            return False
        if self.best.is_plain or self.plain is None:
            return self.margin > 1.0
        return self.margin >= CLEAR and CLEAR * self.best.score < self.plain.score

    @cached_property
    def is_misread(self) -> bool:
        """Whether the rows clearly mean something else, which the saved arm would have to share."""
        best = replace(self.best, inverse=False)
        is_small = best.only_zeros and bool(np.abs(best.zero).max() < SMALL_ZERO)
        return self.is_found and not best.is_plain and not is_small

    @property
    def given(self) -> RowReading | None:
        """The joints as given, in the orientations that are clearly theirs."""
        return self.turned or self.plain

    @property
    def is_far(self) -> bool:
        """Whether the rows are of no such arm, as they are given."""
        return self.given is None or self.given.position > FOREIGN_MISFIT * self.given.robot.reach

    @property
    def choices(self) -> dict[str, RowReading]:
        """The equal readings, each by a change that no other has; else the best one, as `found`."""
        told = Counter(change for r in self.equal for change in r.changes)
        own = [next((c for c in r.changes if told[c] == 1), r.text).partition(" (")[0] for r in self.equal]
        return dict(zip(own, self.equal, strict=True)) or {"found": self.best}

    def accepted(self, how: str) -> RowReading | None:
        """The reading that is accepted so: one of the choices, or the only one by all that it changes."""
        own = {} if self.equal else {self.best.text: self.best, self.best.name: self.best}
        return (own | self.choices).get(how)

    def text(self, *, bare: bool = False) -> str:
        """`joint 3 = q3 + q2: 0.03 mm instead of 220 mm as given (next best 7 458 times worse)`; or what was
        tried in full, and how near the nearest came.

        Args:
            bare: Whether the arm has effects, which are left out here.
        """
        best = self.best
        if not self.is_misread:
            given, tried = self.given, ", ".join(f"{number} {name}" for name, number in self.tried.items())
            size = f"the nominal arm is {given.size} off with the best base and tool" if given else ""
            nearest = tried and f"tried in full: {tried}; the nearest leaves {best.size}"
            return "; ".join(filter(None, [size or "no reading fits", self.told or nearest]))
        instead = "" if self.plain is None else f" instead of {self.plain.size} as given"
        other = f" (next best {self.margin:.3g} times worse)" if self.margin < 1e6 else ""
        equal = [name for name, r in self.choices.items() if self.equal and r is not best]
        if others := equal or self.blind[:2] or _texts(self.open)[:2]:
            other = f"; or else {', or '.join(others)}: these rows can't tell"
        without = " without the arm's effects" if bare and not best.other else ""
        return f"{best.text}: {best.size}{without}{instead}{other}"

    @property
    def remedy(self) -> str:
        """What to do where rows mean something else."""
        if self.cure:
            return self.cure
        if not self.is_found:
            return "choose the robot that was measured, or correct its table"
        if self.best.other:
            anyway = at_entrance("--force to continue anyway", page="'Identify anyway'")
            return f"choose the robot '{self.best.other}', or {anyway}"
        option = f"with reading={' or '.join(map(repr, self.choices))} (--reading)"
        accepted = "accept it " + at_entrance(option, page="by 'Read so'")
        if not self.equal:
            return f"{accepted}, or correct the file"
        alike = "jog the drawn arm beside the real one: where both turn alike, joints count as given"
        return at_entrance(f"jog the arm to see which is true, and {accepted}", page=alike)


def ranked(search: ReadingSearch, plain: RowReading | None) -> RowMeaning:
    """The simplest of the readings that fit alike; the others by what tells them from it."""
    found = sorted(search.found, key=lambda r: r.score)
    ties = [r for r in found if r.score < ALIKE * found[0].score + search.floor]
    ties += [r for r in found if r.is_plain and r.fits and r.score < CLEAR * found[0].score]
    best = min(ties, key=lambda r: (round(r.cost, 3), r.score))
    floor, held = max(best.score, search.floor), search.held
    is_free = held or best.mirrored or not search.conventions  # no instrument mirrors poses
    own = [r for r in found if r.other or r.robot.elements is best.robot.elements]
    told = [r for r in found if r is not best and (held or r not in own or r.text != best.text)]
    rest = [r for r in told if is_free or not r.mirrored]
    near = [r for r in rest if r.score < 4.0 * CLEAR * floor]
    far = min((r.score for r in rest[len(near) :]), default=np.inf)
    low, high = search.data.q.min(0), search.data.q.max(0)
    around = 1.0 / best.unit if held or len(search.arms) > 1 else 0.0
    q = np.random.default_rng(0).uniform(low - around, high + around, (24, len(low)))
    near = near[:NEAR]
    alike = [r for r in near if (_same_poses if held else same_motion)(best, r, q)]
    unseen = [r for r in near if r not in alike and not held and r.score < CLEAR * floor]
    blind = [r for r in unseen if r in own and _same_points(best, r, q)]
    other = [r for r in near if r not in alike and r not in blind]
    rivals = [r for r in other if held or best.is_plain or not {*best.changes} < {*r.changes}]
    equal = () if search.conventions else _equal(best, sorted(blind, key=lambda r: r.cost), q)
    meaning = RowMeaning(
        best=best,
        plain=plain,
        margin=min((r.score for r in rivals), default=far) / floor,
        alike=_texts(alike),
        blind=_texts([r for r in blind if r.mirrored <= best.mirrored and r not in equal]),
        equal=equal,
        open=tuple(sorted((r for r in other if r.score < CLEAR * floor), key=lambda r: r.cost)),
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
        if r.cost < best.cost + HANDED and not says_more and not any(same_motion(k, r, q) for k in kept):
            kept.append(r)
    return tuple(kept[:SHOWN]) if len(kept) > 1 else ()


def _texts(readings: Sequence[RowReading]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(r.text for r in readings))[:SHOWN]


def _same_poses(one: RowReading, other: RowReading, q: np.ndarray) -> bool:
    """Whether two readings put the flange in one pose of the arm's base."""
    off = np.abs(one.flange(q) - other.flange(q))
    is_near = off[..., 3].max() < SAME * one.robot.reach and off[..., :3].max() < 4.0 * SAME
    return bool(one.unit == other.unit and is_near)


def same_motion(
    one: RowReading, other: RowReading, q: np.ndarray, *, off: float = 2e-4, turned: float = 2e-3
) -> bool:
    """Whether two readings move the flange alike at random postures, up to base and tool, a distance `off`,
    as a share of the reach, and an angle `turned` [rad]."""
    if (one.inverse, one.orientation, one.mirrored) != (other.inverse, other.orientation, other.mirrored):
        return False
    seen = flange_poses(one.robot, one.joints(q))[None]
    at = place(other.robot, other.joints(q)[None], seen[..., :3, 3], seen[..., :3, :3], robust=False)
    return bool(at.error.max() < off * one.robot.reach and at.turn.max() < turned)


def _same_points(one: RowReading, other: RowReading, q: np.ndarray) -> bool:
    """Whether two readings predict the same points of the file at random postures."""
    if one.inverse or other.inverse:
        return False
    tips = ((r.base @ flange_poses(r.robot, r.joints(q)) @ r.tool)[:, :3, 3] for r in (one, other))
    seen, own = (tip @ r.axes.T / r.scale for tip, r in zip(tips, (one, other), strict=True))
    error = one.scale * np.sqrt(((seen - own) ** 2).sum(1).mean())
    return bool(error < max(1.5 * max(one.position, other.position), 2e-4 * one.robot.reach))

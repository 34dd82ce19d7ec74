"""Selection of rows: those used, those held out, and notes on the others."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool

from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError
from workbench.base.remedy import remedy
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.data.observations import ContactObservation, DistanceObservation, PlaneObservation
from workbench.data.plausibility import repeated_rows
from workbench.data.postures import pose_units, postures, repeats, repeats_text
from workbench.identification.errors.row_errors import count_measured
from workbench.identification.problem_blocks import carried, of_rows
from workbench.plate.region import Region

Excluded = list[tuple[int, str]]
Known = Collection[str] | None
"""Names of known places; None where rows of another file may tell them."""
Split = TypeVar("Split", bound="AbstractSplit")


@dataclass(frozen=True, eq=False, kw_only=True)
class AbstractSplit:
    """Rows to fit and rows to judge by.

    Args:
        train_rows: Rows to fit, indices into the data.
        held_out_rows: Rows that were held out, indices into the data; those from another file have none.
        excluded: Excluded rows, with the reason.
    """

    train_rows: np.ndarray
    held_out_rows: np.ndarray
    held_out_data: Dataset
    excluded: tuple[tuple[int, str], ...]
    notes: tuple[str, ...]

    @property
    def split(self) -> dict[str, Any]:
        """These fields by name, for another such record."""
        return {f.name: getattr(self, f.name) for f in fields(AbstractSplit)}

    @property
    def is_one_file(self) -> bool:
        """Whether the held-out rows come from the same file as the others."""
        return len(self.held_out_rows) == len(self.held_out_data)


def marked(data: Dataset) -> Excluded:
    """Rows that are marked as excluded, with the reason."""
    reasons = np.full(len(data), "") if data.reason is None else data.reason
    return [(int(data.row[i]), str(reasons[i] or "file")) for i in np.flatnonzero(~data.included)]


def as_marked(split: Split, data: Dataset, part: str = "held_out") -> Split:
    """The rows with a part of them, those held out or "train", as they are here, without those that are
    marked as excluded, and what is noted of them; such ones of the same file are listed."""
    keep, rows, before = data.included, getattr(split, f"{part}_rows"), getattr(split, f"{part}_data")
    new = [note for note in data.notes if note not in before.notes]
    fewer: dict[str, Any] = {f"{part}_data": data.take(keep), "notes": (*split.notes, *new)}
    if not keep.all() and len(rows) == len(data):
        fewer |= {f"{part}_rows": rows[keep], "excluded": (*split.excluded, *marked(data))}
    return replace(split, **fewer)


def without(data: Dataset, exclude: Mapping[int, str]) -> Dataset:
    """The data with more rows marked as excluded by number, with the reason."""
    place = {row: k for k, row in enumerate(data.row.tolist())}
    if unknown := exclude.keys() - place:
        known = f"{int(data.row.min())} … {int(data.row.max())}, {data.counted}"
        raise OptionError(f"can't exclude row {min(unknown)}; there are {known}")
    return data.kept_out({place[n]: why for n, why in exclude.items() if data.included[place[n]]})


def choose_rows(
    robot: Robot, data: Dataset, exclude: Mapping[int, str], region: Region | None, known: Known
) -> tuple[np.ndarray, Excluded]:
    """Rows to use, and excluded ones with the reason."""
    data = without(data, exclude)
    keep, excluded = data.included.copy(), marked(data)
    nothing = keep & ~np.any([~data.included, *carried(data).values()], axis=0)
    if nothing.any() and not nothing[keep].all():
        excluded += [(int(r), "no measurement that depends on the tool's pose") for r in data.row[nothing]]
        keep &= ~nothing
    if region is not None:
        bare = robot.with_frames(base=Frame()).with_effects()
        outside = keep & ~region.contains(tool_poses(bare, Motion(data.q))[:, :3, 3])
        excluded += [(int(r), "outside the region") for r in data.row[outside]]
        keep &= ~outside
    only_touches = carried(data).keys() <= {ContactObservation, PlaneObservation}
    if known is not None and data.contact is not None and only_touches:
        names, counts = np.unique(data.contact[keep], return_counts=True)
        once = keep & np.isin(data.contact, names[counts == 1]) & ~placed(data, known)
        excluded += [(int(r), "touches its contact alone, which tells nothing") for r in data.row[once]]
        keep &= ~once
    if not keep.any():
        why = f"as row {excluded[0][0]}: {excluded[0][1]}"
        raise DataError(f"{data.source}: every row is excluded or outside the region, {why}")
    return np.flatnonzero(keep), excluded


def without_fitted_rows(held_out: Dataset, fitted: Dataset) -> tuple[Dataset, list[str]]:
    """Held-out rows of another file without those that are fitted as well, and a note on these.

    Raises:
        DataError: all of them are fitted; errors on them would be those of the fit.
    """
    is_read = held_out.readings is not None or fitted.readings is not None
    if is_read or {*map(bytes, fitted.q + 0.0)}.isdisjoint(map(bytes, held_out.q + 0.0)):
        return held_out, []
    count, both = len(fitted), fitted.joined(held_out)
    again = [row - count for first, row in repeated_rows(both) if first < count <= row]
    if not again:
        return held_out, []
    if len(again) == len(held_out):
        how = "hold out other measurements, or a share such as 0.2"
        text = f"{held_out.source}: every held-out row is also fitted; {how}"
        raise DataError(text, row=int(held_out.row[again[0]]))
    note = f"{plural(len(again), 'held-out row')} ignored, as the fit uses the same measurements"
    return held_out.take(np.delete(np.arange(len(held_out)), again)), [note]


def hold_out(
    data: Dataset, stays: Bool[np.ndarray, " rows"], held_out: float | tuple[str, ...], seed: int
) -> Bool[np.ndarray, " used"]:
    """Which of the rows that stay are held out; the others were excluded, and take part in the draw alone, so
    that excluding some changes little else.

    Of a fraction whole postures and groups stay together: these units (means of their rows) are divided by
    medians of their widest joint into as many cells as are to be held out, session by session. One random
    unit of each cell comes first in a random order, and those of the first that stay are held out: they cover
    the same joint space as the others, whatever the order of measurement. Where they are fewer than the
    fraction of what stays, the next in order follow.
    """
    if isinstance(held_out, tuple):
        return _of_sessions(of_rows(data, np.flatnonzero(stays)), held_out)
    if held_out == 0.0:
        return np.zeros(np.count_nonzero(stays), bool)
    labels, keep, names = pose_units(data), placing_rows(data), np.zeros(len(data), int)
    if data.session is not None:
        names = np.unique(data.session, return_inverse=True)[1]
        units = np.bincount(np.unique([names[stays], labels[stays]], axis=1)[0], minlength=names.max() + 1)
        spare = np.maximum(units - keep, 0).sum()
        if (units > 0).sum() > 1 and spare < max(round(held_out * units.sum()), 1):
            labels, names = names, np.zeros(len(data), int)  # whole sessions are held out
    count = int(labels.max(initial=-1)) + 1
    there = np.bincount(labels[stays], minlength=count) > 0
    if there.sum() < 2:
        few = "rows of one pose or group are too few to hold some out"
        how = "use share 0" if postures(data.q[stays]).max(initial=0) > 3 else "measure at least 5 poses"
        raise DataError(f"{data.source}: {few}: {how}")
    weight = np.bincount(labels)
    centre = np.stack([np.bincount(labels, column) / weight for column in data.q.T], axis=1)
    centre = centre / np.maximum(np.ptp(data.q, axis=0), 1e-9)
    session = np.zeros(count, int)
    session[labels] = names
    keep, rng = keep if session.any() else 1, np.random.default_rng(seed)
    rank, held = rng.spawn(1)[0].permutation(count), np.zeros(count, bool)
    sizes = (np.bincount(session[rows], minlength=session.max() + 1) for rows in (there | True, there))
    first, wanted = (_shares(size, held_out, keep).tolist() for size in sizes)
    for s, number in enumerate(first):
        for cell in cells(centre, np.flatnonzero(session == s), number):
            rank[cell[rng.integers(len(cell))]] -= count  # before all others
    for s, number in enumerate(wanted):
        mine = np.flatnonzero(there & (session == s))
        most = min(max(number, (rank[mine] < 0).sum()), max(len(mine) - keep, 0))
        held[mine[rank[mine].argsort()[:most]]] = True
    return held[labels][stays]


def _of_sessions(data: Dataset, names: tuple[str, ...]) -> Bool[np.ndarray, " rows"]:
    """Which rows are held out, if it is whole sessions by name."""
    if data.session is None:
        text = f"{data.source} has no session column, so no session '{', '.join(names)}' can be held out"
        raise OptionError(f"{text}; give a share such as 0.2, or a file", option="held_out", found=names)
    if missing := [name for name in names if name not in data.sessions]:
        there = f"no usable row is of session '{missing[0]}', only of {', '.join(data.sessions)}"
        why = "rows that are excluded or far off any pose of the arm, as with another base, can't be held out"
        raise OptionError(f"{data.source}: {there}; {why}", option="held_out", found=missing[0])
    return np.isin(data.session, names)


def placing_rows(data: Dataset) -> int:
    """Rows that place a session and tell something beyond, where each has a base of its own."""
    return 1 if data.session is None or data.position is None else 3 if data.rotation is None else 2


def _shares(sizes: np.ndarray, fraction: float, keep: int) -> np.ndarray:
    """Number of units held out per session: the total share, divided as evenly as possible; so many stay."""
    total = max(round(fraction * int(sizes.sum())), 1)
    shares = np.clip(np.floor(fraction * sizes), 0, np.maximum(sizes - keep, 0)).astype(int)
    wanting = fraction * sizes - shares
    for s in np.argsort(-wanting, kind="stable"):
        if shares.sum() < total and shares[s] < sizes[s] - keep:
            shares[s] += 1
    return shares


def cells(centre: np.ndarray, units: np.ndarray, count: int) -> list[np.ndarray]:
    """Divide units recursively into cells of nearly equal size along their widest joint."""
    if count <= 1:
        return [units] if count else []
    mine = centre[units]
    order = units[mine[:, (mine.max(0) - mine.min(0)).argmax()].argsort(kind="stable")]
    left = count // 2
    cut = round(len(order) * left / count)
    return cells(centre, order[:cut], left) + cells(centre, order[cut:], count - left)


def check_sessions(data: Dataset) -> None:
    """Refuse sessions of one or two rows, which a base of their own fits exactly."""
    count = len(data.sessions)
    if count > 1 and len(data) <= MAX_FITTED_ROWS * count and count_measured(data) <= FRAME_NUMBERS * count:
        shared = remedy("frames='shared' (--frames shared)", page="frames that sessions share")
        tell = f"{count} sessions of {plural(len(data), 'row')} tell only a base for each"
        text = f"{data.source}: {tell}: leave the column out, or choose {shared}"
        raise DataError(text, column="session")


def check_enough(robot: Robot, data: Dataset, free: Sequence[str] | None, *, held_out: float = 0.0) -> None:
    """Refuse more parameters than measured numbers; one posture counts once, and a share was held out."""
    once = of_rows(data, np.unique(repeats(data), return_index=True)[1])
    count = len(robot.default_free if free is None else free)
    measured = count_measured(once)
    if measured < count:
        need = int(np.ceil(np.ceil(count / (measured / len(once))) / (1.0 - held_out)))
        rows = f"{repeats_text(data) or plural(len(once), 'row')} give{'s' if len(data) == 1 else ''}"
        beside = f" ({held_out:.0%} of which are held out)" if held_out else ""
        raise DataError(
            f"{data.source}: {rows} {measured} numbers for {count} parameters of the arm; measure at least "
            f"{need} poses{beside}, hold fewer out, or free fewer parameters",
            found=(len(once), measured),
        )


def unused_observations(data: Dataset) -> list[str]:
    """Notes on observations that rows carry beside the one that is used."""
    left = np.ones(len(data), bool)
    sentences = []
    for kind, applies in carried(data).items():
        beside = applies & ~left & (kind.unused_text != "")
        if beside.any():
            sentences.append(f"{int(beside.sum())} rows also carry {kind.unused_text}, which are ignored")
        left &= ~applies
    if not any(kind.sees_tool for kind in carried(data)):
        sentences.append("only tilts of links were measured; position errors are unknown and shown as 0")
    return sentences


MAX_FITTED_ROWS, FRAME_NUMBERS = 2, 6
"""Rows of a session, and measured numbers, that a base fits exactly."""
MIN_TURNED = 0.1
"""Smallest difference in direction among rows of a length that they turn."""
MIN_KNOWN_SHARE = 0.2
"""Share of the arm's lengths that must be known to determine its scale."""


def scale_fixing_length(
    robot: Robot, data: Dataset, free: Sequence[str], known: Mapping[str, float]
) -> str | None:
    """The length to hold because the rows don't determine scale: contacts with unknown places only.

    Shrinking arm and places together changes no contact, so a free fit would shrink to a point. Known lengths
    that the rows turn determine the scale; one along the first axis only moves all places alike.
    """
    kinds = carried(data).keys()
    without_scale = bool(kinds) and kinds <= {ContactObservation, PlaneObservation}
    if not without_scale or any(n.startswith("contact[") for n in known):
        return None
    lengths = [e for e in robot.elements if e.unit == "m" and e.matrix is None]
    ways = identification_jacobian(robot, Motion(data.q), tuple(e.name for e in lengths))[1][:, :3]
    turned = np.ptp(ways, axis=0).max(0) > MIN_TURNED
    lengths = [e for e, holds in zip(lengths, turned, strict=True) if holds]
    unknown = [e for e in lengths if e.name in free]
    total, open_ones = (sum(abs(e.value) for e in part) for part in (lengths, unknown))
    if not unknown or total - open_ones >= MIN_KNOWN_SHARE * total:
        return None
    return max(unknown, key=lambda e: abs(e.value)).name


def placed(data: Dataset, known: Collection[str]) -> np.ndarray:
    """Rows whose anchor or contact has a known place, and all rows that are compared with nothing of these.

    Args:
        known: Names of known coordinates.
    """
    keep, left = np.ones((2, len(data)), bool)
    if data.anchor is None and data.contact is None:
        return keep
    places = {DistanceObservation: "anchor", ContactObservation: "contact", PlaneObservation: "contact"}
    for kind, rows in carried(data).items():
        if (labels := data.column(places.get(kind, ""))) is not None:  # without any all are of one anchor
            own = np.flatnonzero(rows & left)
            keep[own] = [f"{places[kind]}[{label}].x" in known for label in labels[own]]
        left &= ~rows
    return keep

"""Long tables, one row a reflector: rows of one posture become one row with markers.

A tool with three reflectors is often listed as three rows of equal joints, told apart by `point`. Sockets
have the same column, but each its own postures.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from workbench.base.wording import listed, plural
from workbench.data.readers.fields import Fields

STILL = 1e-4
"""Joints of an arm that stood still differ by no more, as read [rad or m]."""
MAX_MARKERS = 20
MIN_SHARE, MIN_SEEN = 0.5, 1.5
"""A reflector is seen at this share of the postures or more, and so many at a posture on the mean."""
MERGED = ("x", "y", "z", "point", "exclude", "reason")
"""Columns that the markers replace; a marker of an excluded row was not seen."""
ORIENTED = {"qw", "rx", "roll", "r11", "zxz_phi"}
"""A first column of each form of orientation."""


def with_markers(
    fields: Fields, q: Float[np.ndarray, "rows n"], excluded: Bool[np.ndarray, " rows"]
) -> Fields:
    """One row a posture with markers m1, m2 … where a file lists several points of a posture in rows."""
    held = set(fields.values)
    if not set(MERGED[:4]) <= held or held & (ORIENTED | {"m1x"}) or fields.rotation is not None:
        return fields
    names = [str(name).strip() for name in fields.values["point"]]
    sessions = fields.values.get("session", np.zeros(fields.rows))
    groups, seen = list[list[int]](), set[str]()
    for row in np.flatnonzero(~excluded).tolist():  # one after another with the same joints, every name once
        last = groups[-1][0] if groups else row
        still = np.abs(q[row] - q[last]).max() <= STILL and sessions[row] == sessions[last]
        if not groups or not still or names[row] in seen:
            groups.append([])
            seen = set()
        groups[-1].append(row)
        seen.add(names[row])
    found = [names[row] for group in groups for row in group]
    markers = list(dict.fromkeys(found))
    fewest = min(map(found.count, markers[: MAX_MARKERS + 1]), default=0)
    is_seen = fewest >= MIN_SHARE * len(groups) and len(found) >= MIN_SEEN * len(groups)
    if not groups or "" in markers or len(markers) > MAX_MARKERS or not is_seen:
        return fields
    xyz = np.stack([fields.values[axis] for axis in "xyz"], axis=1)
    places = np.full((len(groups), len(markers), 3), np.nan)
    for posture, group in zip(places, groups, strict=True):
        posture[[markers.index(names[row]) for row in group]] = xyz[group]
    taken = fields.take(np.array([group[0] for group in groups]))
    values = {key: values for key, values in taken.values.items() if key not in MERGED}
    values |= {f"m{m + 1}{a}": places[:, m, i] for m in range(len(markers)) for i, a in enumerate("xyz")}
    what = f"{plural(len(found), 'row')} at {plural(len(groups), 'posture')}"
    note = f"{listed(markers)} are markers of one tool: {what}"
    return replace(taken, values=values, notes=(*taken.notes, note))

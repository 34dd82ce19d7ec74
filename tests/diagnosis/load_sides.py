"""Noise-free rows in which nobody can tell on which side of its play a loose joint rests.

The load about a joint's axis is linear in masses m and first moments h = m c of the links. What is known of
these is what the file says, give or take its errors, and the sign of the load in every measured row, which
the pose shows. Where both signs of a noise-free row's load agree with all of that, by a linear program each,
the row is open: no program can be blamed for the side that it takes.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import linprog

SLACK = 0.02
"""Loads below this [N m or N] may change sign as the arm is deflected, so that they tell nothing."""


def open_rows(actual, filed, effects, measured, exact, masses, coms):
    """Which of some rows are open (rows,)."""
    loose = [e.joints[0] for e in effects if e.name == "backlash" and e.detail == "moment"]
    out = np.zeros(len(exact.q), bool)
    if not loose or not masses + coms:
        return out
    true = _moments(actual.masses, actual.coms)
    rows, limit = _box(filed, masses, coms)
    given, stated = _loads(actual, measured)
    for joint in loose:
        load = given[:, joint] + stated[:, joint] @ true
        sure, side = np.abs(load) > SLACK, np.sign(load)
        rows.append(-(side[:, None] * stated[:, joint])[sure])
        limit.append((side * given[:, joint])[sure])
    known = {"A_ub": np.vstack(rows), "b_ub": np.concatenate(limit), "bounds": (None, None)}
    given, stated = _loads(actual, exact)
    for joint in loose:
        load = given[:, joint] + stated[:, joint] @ true
        for row in np.flatnonzero(np.abs(load) < _reach(filed, masses, coms, stated[:, joint])):
            minimum = linprog(np.sign(load[row]) * stated[row, joint], **known, method="highs")
            out[row] |= minimum.success and minimum.fun + np.sign(load[row]) * given[row, joint] < 0.0
    return out


def _moments(masses, coms):
    """Mass and first moments of every link, one after the other."""
    return np.column_stack([masses, masses[:, None] * coms]).ravel()


def _box(filed, masses, coms):
    """What the file says, as rows A and limits b of A x ≤ b: masses, and centres h = m c, either way."""
    size = 4 * filed.dof
    rows, limit = [], []
    for link, (mass, com) in enumerate(zip(filed.masses, filed.coms, strict=True)):
        for sign in (1.0, -1.0):
            rows.append(sign * np.eye(size)[4 * link])
            limit.append(sign * mass + masses * mass)
            for axis in range(3):
                row = sign * np.eye(size)[4 * link + 1 + axis]
                row[4 * link] = -sign * com[axis] - coms
                rows.append(row)
                limit.append(0.0)
    return [np.array(rows)], [np.array(limit)]


def _reach(filed, masses, coms, stated):
    """How far errors of the file can move loads at most (rows,)."""
    off = np.column_stack([masses * filed.masses, (filed.masses * coms)[:, None] * np.ones(3)])
    off[:, 1:] += masses * filed.masses[:, None] * np.abs(filed.coms)
    return 3.0 * np.abs(stated) @ off.ravel()


def _loads(arm, state):
    """Loads of the payload alone (rows, n), and their derivative in masses and moments (rows, n, 4 n)."""
    before, links = arm.straight(state.q)

    def about(masses, coms, rows):
        other = replace(arm, masses=masses, coms=coms)
        return other.holding(before, links, rows.payload, rows.wrench)[:, :, 2]

    none, bare = np.zeros((arm.dof, 3)), replace(state, payload=0.0 * state.payload)
    columns = []
    for link in np.eye(arm.dof):
        own = about(link, none, bare)
        columns.append(own)
        columns += [about(link, none + axis, bare) - own for axis in np.eye(3)]
    return about(np.zeros(arm.dof), none, state), np.stack(columns, 2)

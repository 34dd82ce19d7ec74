"""Contacts with planes whose names don't begin so: no fixed point explains them, but planes do."""

from dataclasses import replace

import numpy as np

from workbench.arm.frame import FRAME_PARTS
from workbench.arm.robot import Robot
from workbench.base.wording import in_mm, listed
from workbench.data.dataset import Dataset
from workbench.data.observations.places import PLANE, ContactObservation
from workbench.identification.alignment import align
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.meaning.reading import FITS
from workbench.identification.problem import FrameFreedom

CLEAR = 10.0
"""By how much planes must fit better than points."""


def with_planes(robot: Robot, data: Dataset) -> Dataset:
    """The rows, in which contacts that only planes explain are named so, with a note."""
    if data.contact is None or data.position is not None or data.joints != robot.dof:
        return data
    rows = np.flatnonzero(data.included & ContactObservation.applies(data))
    each = ((str(name), rows[data.contact[rows] == name]) for name in {*data.contact[rows]})
    off = {name: _misfit(robot, data.take(own)) for name, own in each}
    flat = sorted(name for name, size in off.items() if size > FITS * robot.reach)
    found = {name: f"{PLANE} {name}" for name in flat}
    as_planes = replace(data, contact=np.array([found.get(n, n) for n in data.contact.tolist()]))
    rows = rows[np.isin(data.contact[rows], flat)]
    if len(rows) < 6 * (len(flat) + 1):  # twice the unknowns
        return data
    far, near = min(off[name] for name in flat), _misfit(robot, as_planes.take(rows))
    if near > min(FITS * robot.reach, far / CLEAR):
        return data
    note = f"contacts {listed(flat)} are read as with planes: {in_mm(near)} off, of fixed points {in_mm(far)}"
    return replace(as_planes, notes=(*data.notes, note))


def _misfit(robot: Robot, touches: Dataset) -> float:
    """Root mean square distance [m] of touches from the places that they name, with the best tool point."""
    aligned = align(robot.bare, touches, FrameFreedom((), FRAME_PARTS[:3]))
    return float(np.sqrt((row_errors(aligned, touches).position ** 2).mean()))

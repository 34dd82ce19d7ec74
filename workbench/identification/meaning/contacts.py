"""Contacts with planes whose names don't begin so: no fixed point explains them, but planes do."""

from dataclasses import replace

import numpy as np

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.wording import in_mm, listed
from workbench.data.dataset import Dataset
from workbench.data.observations.places import PLANE, ContactObservation, PlaneObservation
from workbench.identification.meaning.reading import FITS

CLEAR, ROUNDS = 10.0, 20
"""By how much planes must fit better than points, and number of steps to the tool's point."""


def with_planes(robot: Robot, data: Dataset) -> Dataset:
    """The rows, in which contacts that only planes explain are named so, with a note."""
    rows = np.flatnonzero(data.included & ContactObservation.applies(data))
    if data.contact is None or data.joints != robot.dof or not len(rows):
        return data
    off = {
        str(name): _misfit(robot, data.take(rows[data.contact[rows] == name]))
        for name in {*data.contact[rows]}
    }
    flat = sorted(name for name, size in off.items() if size > FITS * robot.reach)
    found = {name: f"{PLANE} {name}" for name in flat}
    as_planes = replace(data, contact=[found.get(name, name) for name in data.contact.tolist()])
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
    kind = PlaneObservation if PlaneObservation.applies(touches).all() else ContactObservation
    seen, poses, tip = kind.of(touches), chains.poses(robot.bare.chain, touches.q), robot.tool.xyz
    for _ in range(ROUNDS):
        placed = poses @ se3.pose(np.eye(3), tip)
        at = seen.linearise(placed, seen.start(placed))
        by_tip = at.by_twist[:, :, :3] @ poses[:, :3, :3]
        both = np.concatenate([by_tip, at.by_unknown], axis=2).reshape(-1, 3 + 3 * len(seen.names))
        tip = tip + np.linalg.lstsq(both, at.residual.ravel(), rcond=1e-6)[0][:3]
    return float(np.sqrt((at.residual**2).sum(1).mean()))

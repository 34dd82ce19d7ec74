"""Whether the poses of measurements suffice for a diagnosis, and which joints they hardly moved."""

from dataclasses import replace

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import turns
from workbench.arm.effects.effect import STILL
from workbench.base.advice import beside
from workbench.base.hand_eye import nearest_rotation
from workbench.data.dataset import Dataset
from workbench.data.postures import postures, within_postures
from workbench.identification.fit import Fit

SMALL_TRAVEL = np.deg2rad(30.0)
"""Range of a joint below which it moved little [rad]; below `STILL` it did not move."""
MIN_SPREAD = 0.02
"""Share of the widest spread of poses below which a direction in joint space was not measured."""
ONLY_LOADS = (
    "the poses are too few, or vary in too few directions of joint space, to separate other effects from "
    "geometry: only effects of the load, which changes at the same postures, were tried"
)
MIN_LOAD_CHANGE, MIN_LOADED_POSTURES = 0.03, 5
"""Change of the load about its mean at a posture, as a share of its range, at so many postures."""
MIN_NUMBERS_PER_UNKNOWN = 3.0
"""Minimum measured numbers per unknown to separate effects from geometry."""
MAX_RIGID_SHARE = 0.05
"""Change of distances between markers, as a share of the error, below which they count as one body."""
MIN_BODY = 0.005
"""Width of a body [m] from which on its markers tell an orientation."""


@beside("whether the rows suffice for effects", None)
def too_few_rows(fit: Fit) -> str | None:
    """A sentence if the rows are too few to separate effects from geometry, and how many are missing."""
    unknowns, data = len(fit.problem.names), fit.problem.data
    if 2 * freedoms(data) < data.joints:
        return (
            f"The {len(data)} poses vary in only {freedoms(data)} of {data.joints} independent directions of "
            "joint space, too few to separate effects from geometry, so no effects were tried; measure poses "
            "spread over all joints."
        )
    if _are_one_body(fit):
        return (
            "The markers of a row move as one rigid body, to a small part of the error: they are one pose, "
            "so no effects were tried; give x, y, z and an orientation, or markers as they were measured."
        )
    if fit.problem.count >= MIN_NUMBERS_PER_UNKNOWN * unknowns:
        return None
    per_row = fit.problem.count / max(len(fit.problem.data), 1)
    missing = int(MIN_NUMBERS_PER_UNKNOWN * unknowns / per_row) + 1 - len(fit.problem.data)
    return (
        f"{len(fit.problem.data)} rows for {unknowns} unknowns are too few to separate effects from "
        f"geometry, so no effects were tried; measure about {missing} more poses, spread over all joints."
    )


def _are_one_body(fit: Fit) -> bool:
    """Whether markers were fitted to a body, or seen so well that all their errors are the arm's alike."""
    markers, problem = fit.problem.data.markers, fit.problem
    if markers is None or markers.shape[1] < 3:
        return False
    gaps = np.linalg.norm(markers - np.roll(markers, 1, axis=1), axis=2)
    errors = problem.physical(problem.residual(fit.x)[: problem.size])
    return bool(np.nanstd(gaps, axis=0).max() < MAX_RIGID_SHARE * np.sqrt((errors**2).mean()))


def one_pose(fit: Fit, data: Dataset) -> Dataset | None:
    """The rows as poses of the body that the markers of each are, at the places that a fit found; None if
    they are no one body, or on a line. Rows that show less than three of them are kept out."""
    if data.markers is None or not _are_one_body(fit):
        return None
    places = [v for name, v in fit.problem.instrument(fit.x).items() if name.startswith("marker")]
    body, seen = np.reshape(places, (-1, 3)), np.isfinite(data.markers).all(2)
    share = seen / np.maximum(seen.sum(1, keepdims=True), 1)
    markers = np.where(seen[..., None], data.markers, 0.0)
    middle, centre = share @ body, (share[..., None] * markers).sum(1)
    there, own = markers - centre[:, None], body - middle[:, None]
    turn = nearest_rotation(spread := np.einsum("rm,rmi,rmj->rij", seen, there, own))
    told = np.linalg.svd(spread, compute_uv=False)[:, 1] > MIN_BODY**2
    if told.mean() < 0.5:
        return None
    note = "the markers of a row move as one rigid body, to a small part of the error: read as its pose"
    position = centre - (turn @ middle[..., None])[..., 0]
    poses = replace(data, markers=None, position=position, rotation=turn, notes=(*data.notes, note))
    return poses.kept_out(
        dict.fromkeys(np.flatnonzero(~told & data.included).tolist(), "shows too few markers")
    )


def loads_vary(data: Dataset) -> bool:
    """Whether the load changes at some postures, so that geometry can't take its effects there."""
    for load in (data.torque, data.payload):
        if load is None or not np.isfinite(load).all():
            continue
        table = load.reshape(len(data), -1)
        change = np.abs(within_postures(data.q, table)).max(1)
        changed = change > MIN_LOAD_CHANGE * np.ptp(table, axis=0).max()
        if len(np.unique(postures(data.q)[changed])) >= MIN_LOADED_POSTURES:
            return True
    return False


def freedoms(data: Dataset) -> int:
    """Number of independent directions in joint space in which the poses vary."""
    span = np.ptp(data.q, axis=0)
    spread = (data.q - data.q.mean(0)) / np.maximum(span, STILL)
    strength = np.linalg.svd(spread, compute_uv=False)
    return int((strength > MIN_SPREAD * strength[0]).sum()) if span.max() > STILL else 0


@beside("notes on the coverage of joints", ())
def coverage(data: Dataset, chain: Chain) -> list[str]:
    """Notes on joints that moved little or only together."""
    span = np.ptp(data.q, axis=0)
    notes = [
        f"joint {j + 1} moved over only {np.rad2deg(span[j]):.0f}°; its errors outside this range are unknown"
        for j in range(data.joints)
        if turns(chain, j) and STILL < span[j] < SMALL_TRAVEL
    ]
    together = freedoms(data)
    if together < int((span > STILL).sum()):
        notes.append(
            f"the joints moved together, in {together} instead of {data.joints} independent directions: the "
            "result is valid for such poses, and effects of different joints can hardly be separated"
        )
    return notes

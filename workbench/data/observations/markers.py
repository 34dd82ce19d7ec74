"""Several markers on the tool, whose places on it are unknown and found with the robot.

Where the markers' places are known, `marker_poses` fits the rigid transform row by row instead and
reports its residual, as the motion-capture set-up of ARIA 5.1 does; the rows then are full poses.
"""

from dataclasses import replace
from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractObservation, Channel, Linearised


@final
class MarkerObservation(AbstractObservation):
    """Residual of every marker, m_k − (p̂ + R̂ u_k) with its unknown place u_k in the tool frame.

    The tool frame itself is then a free choice: hold it at its nominal pose. Hidden markers (NaN) have
    zero residual and zero derivative.
    """

    measured: Float[np.ndarray, "rows markers 3"]

    columns = ("markers",)
    unused_text = "markers"
    is_tool_free = True

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (Channel.POSITION,) * (3 * self.measured.shape[1])

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        if data.markers is None:
            return np.zeros(len(data), bool)
        return np.isfinite(data.markers).all(-1).any(-1)

    @property
    def seen(self) -> Bool[np.ndarray, "..."]:
        return np.repeat(np.isfinite(self.measured).all(-1), 3, axis=1)

    @property
    def unknowns(self) -> tuple[str, ...]:
        return tuple(f"marker{k + 1}.{axis}" for k in range(self.measured.shape[1]) for axis in "xyz")

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        local = se3.apply(se3.inverse(poses)[:, None], self.measured)
        seen = np.isfinite(local)
        total = np.where(seen, local, 0.0).sum(0)
        return (total / np.maximum(seen.sum(0), 1)).ravel()

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        rows, count = self.measured.shape[:2]
        rotation = poses[:, None, :3, :3]
        arm = (rotation @ unknown.reshape(count, 3)[None, :, :, None])[..., 0]
        seen = np.isfinite(self.measured).all(-1)[..., None]
        residual = np.where(seen, self.measured - poses[:, None, :3, 3] - arm, 0.0)
        by_twist = np.concatenate([np.broadcast_to(np.eye(3), (rows, count, 3, 3)), -se3.skew(arm)], axis=-1)
        by_twist = np.where(seen[..., None], by_twist, 0.0)
        by_unknown = np.zeros((rows, count, 3, count, 3))
        for k in range(count):
            by_unknown[:, k, :, k] = np.where(seen[:, k, :, None], poses[:, :3, :3], 0.0)
        shape = (rows, 3 * count)
        return Linearised(
            residual.reshape(shape), by_twist.reshape(*shape, 6), by_unknown.reshape(*shape, 3 * count)
        )


def marker_poses(
    data: Dataset, layout: Float[np.ndarray, "markers 3"]
) -> tuple[Dataset, Float[np.ndarray, " rows"]]:
    """Full poses from markers at known places of the tool, with the residual of the rigid fit.

    Args:
        data: Rows with markers.
        layout: Places of the markers in the tool frame [m].

    Returns:
        The data with poses instead of markers, and the rms distance [m] of the markers from the fit.
    """
    if data.markers is None:
        raise DataError(f"{data.source}: there are no marker columns (m1x[mm] …)")
    poses, residual = np.empty((len(data), 4, 4)), np.empty(len(data))
    for i, measured in enumerate(data.markers):
        seen = np.isfinite(measured).all(-1)
        spread = np.linalg.svd(layout[seen] - layout[seen].mean(0), compute_uv=False) if seen.any() else [0]
        if seen.sum() < 3 or spread[1] < 1e-3:
            raise DataError(
                f"{data.source}, data row {data.row[i]}: {seen.sum()} markers seen; "
                "a pose needs three that are not on one line. Exclude the row",
                row=int(data.row[i]),
                found=int(seen.sum()),
            )
        poses[i] = se3.best_fit(layout[seen], measured[seen])
        off = measured[seen] - se3.apply(poses[i], layout[seen])
        residual[i] = np.sqrt((off**2).sum(-1).mean())
    note = f"poses from {len(layout)} markers at known positions: rms residual {1e3 * residual.mean():.3f} mm"
    position, rotation, notes = poses[:, :3, 3], poses[:, :3, :3], (*data.notes, note)
    found = replace(data, markers=None, position=position, rotation=rotation, notes=notes)
    return found, frozen(residual)


def synchronise(
    data: Dataset, seen_base: Float[np.ndarray, "markers 3"], base_layout: Float[np.ndarray, "markers 3"]
) -> tuple[Dataset, float]:
    """Bring poses from a motion-capture frame into the robot's base frame (ARIA 5.1).

    Args:
        data: Rows with positions, and perhaps rotations, in the motion-capture frame.
        seen_base: The base's markers as the motion capture sees them [m].
        base_layout: The same markers in the robot's base frame, as designed [m].

    Returns:
        The data in the base frame, and the rms distance [m] of the base's markers from the rigid fit.
    """
    if data.position is None:
        raise DataError(f"{data.source}: there are no positions to transform into the base frame")
    fit = se3.best_fit(seen_base, base_layout)
    residual = float(np.sqrt(((se3.apply(fit, seen_base) - base_layout) ** 2).sum(-1).mean()))
    note = f"frames synchronised by {len(base_layout)} base markers: rms residual {1e3 * residual:.3f} mm"
    rotation = None if data.rotation is None else fit[:3, :3] @ data.rotation
    position, notes = se3.apply(fit, data.position), (*data.notes, note)
    return replace(data, position=position, rotation=rotation, notes=notes), residual

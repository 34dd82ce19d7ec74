"""Readers of measured data: any table, in any common unit and form, becomes one `Dataset` in SI."""

from workbench.data.readers.read import AS_HEADED, Preview, preview, read_measurements
from workbench.data.readers.trajectory import Trajectory, read_trajectory

__all__ = ["AS_HEADED", "Preview", "Trajectory", "preview", "read_measurements", "read_trajectory"]

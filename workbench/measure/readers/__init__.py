"""Readers of measured data: any table, in any common unit and form, becomes one `Dataset` in SI."""

from workbench.measure.readers.preview import Preview, PreviewColumn, preview
from workbench.measure.readers.read import read_measurements
from workbench.measure.readers.trajectory import Trajectory, read_trajectory

__all__ = ["Preview", "PreviewColumn", "Trajectory", "preview", "read_measurements", "read_trajectory"]

"""The panels of the page; each says its tab and its place in it itself."""

from workbench.parts import parts
from workbench.views.page.panels.arm import ArmPanel
from workbench.views.page.panels.columns import ColumnsPanel
from workbench.views.page.panels.compare import ComparePanel
from workbench.views.page.panels.data import DataPanel
from workbench.views.page.panels.diagnose import DiagnosePanel
from workbench.views.page.panels.display_options import LookPanel
from workbench.views.page.panels.files import FilesPanel
from workbench.views.page.panels.fit import FitDetailsPanel, FitPanel
from workbench.views.page.panels.history import HistoryPanel
from workbench.views.page.panels.index import DetailsPanel, IndexPanel
from workbench.views.page.panels.jog import CapturedPanel, JogPanel, ToolPanel
from workbench.views.page.panels.joints import JointsPanel
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.plate import ImprovePanel, NoisePanel, PlateFilesPanel
from workbench.views.page.panels.region import RegionPanel
from workbench.views.page.panels.row_errors import RowErrorsPanel
from workbench.views.page.panels.selected_target import BranchesPanel, TargetsPanel

PANELS: tuple[type[AbstractPanel], ...] = (
    ArmPanel,
    JogPanel,
    ToolPanel,
    CapturedPanel,
    LookPanel,
    TargetsPanel,
    BranchesPanel,
    IndexPanel,
    DetailsPanel,
    ImprovePanel,
    PlateFilesPanel,
    NoisePanel,
    HistoryPanel,
    RegionPanel,
    DataPanel,
    ColumnsPanel,
    FitPanel,
    DiagnosePanel,
    RowErrorsPanel,
    JointsPanel,
    FitDetailsPanel,
    ComparePanel,
    FilesPanel,
)
"""The built-in ones, in no order."""


def panels() -> tuple[type[AbstractPanel], ...]:
    """All panels: ours, and those of extras and other packages."""
    return PANELS + parts("panels", AbstractPanel, classes=True)

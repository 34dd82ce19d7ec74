"""The known layouts; a new one is a small file and one line here, or `LAYOUTS.register`."""

from workbench.base.registry import Registry
from workbench.data.readers.layouts.c3d import C3d
from workbench.data.readers.layouts.ipa_grid import IpaGrid
from workbench.data.readers.layouts.layout import AbstractFileLayout, AbstractTableLayout
from workbench.data.readers.layouts.mocap import Mocap
from workbench.data.readers.layouts.mukca import Mukca
from workbench.data.readers.layouts.ros_bag import RosBag
from workbench.data.readers.layouts.rtde import Rtde
from workbench.data.readers.layouts.target_deviation import TargetDeviation

PLAIN = "plain"
"""The layout of formats.md, for tables that would else be taken for one of the others."""
LAYOUTS: Registry[AbstractTableLayout | AbstractFileLayout] = Registry(
    "layout",
    (AbstractTableLayout, AbstractFileLayout),
    IpaGrid(),
    TargetDeviation(),
    Rtde(),
    Mukca(),
    RosBag(),
    C3d(),
    Mocap(),
    group="workbench.layouts",
)
"""Layouts of tables and of whole files, in the order in which they are tried."""


def table_layouts() -> list[AbstractTableLayout]:
    """Those of tables."""
    return [known for known in LAYOUTS.values() if isinstance(known, AbstractTableLayout)]


def file_layouts() -> list[AbstractFileLayout]:
    """Those of files and folders."""
    return [known for known in LAYOUTS.values() if isinstance(known, AbstractFileLayout)]

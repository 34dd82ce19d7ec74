"""The known layouts; a new one is a small file and one line here."""

from workbench.data.readers.layouts.c3d import C3d
from workbench.data.readers.layouts.ipa_grid import IpaGrid
from workbench.data.readers.layouts.layout import AbstractFileLayout, AbstractTableLayout
from workbench.data.readers.layouts.mocap import Mocap
from workbench.data.readers.layouts.mukca import Mukca
from workbench.data.readers.layouts.ros_bag import RosBag
from workbench.data.readers.layouts.rtde import Rtde
from workbench.data.readers.layouts.target_deviation import TargetDeviation

TABLE_LAYOUTS: tuple[AbstractTableLayout, ...] = (IpaGrid(), TargetDeviation(), Rtde())
FILE_LAYOUTS: tuple[AbstractFileLayout, ...] = (Mukca(), RosBag(), C3d(), Mocap())
PLAIN = "plain"
"""The layout of formats.md, for tables that would else be taken for one of the others."""
NAMES = (PLAIN, *(known.name for known in TABLE_LAYOUTS), *(known.name for known in FILE_LAYOUTS))
"""Every layout that can be asked for."""

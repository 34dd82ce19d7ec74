"""Layouts that are known by name; another is one small file and one line here."""

from workbench.data.readers.layouts.ipa_grid import IpaGrid
from workbench.data.readers.layouts.layout import AbstractFolderLayout, AbstractTableLayout
from workbench.data.readers.layouts.mukca import Mukca
from workbench.data.readers.layouts.target_deviation import TargetDeviation

TABLE_LAYOUTS: tuple[AbstractTableLayout, ...] = (IpaGrid(), TargetDeviation())
FOLDER_LAYOUTS: tuple[AbstractFolderLayout, ...] = (Mukca(),)
PLAIN = "plain"
"""The layout of formats.md, for tables that would else be taken for one of the others."""
NAMES = (PLAIN, *(layout.name for layout in TABLE_LAYOUTS), *(layout.name for layout in FOLDER_LAYOUTS))

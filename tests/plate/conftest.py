"""The plate of the ARIA paper."""

import pytest

from workbench.plate.plate_toml import load_plate
from workbench.plate.target_branches import plate_solutions


@pytest.fixture(scope="session")
def plate():
    """Table 2 of the ARIA paper."""
    return load_plate("table2")


@pytest.fixture(scope="session")
def solutions(aria, plate):
    """All branches of its targets."""
    return plate_solutions(aria, plate)

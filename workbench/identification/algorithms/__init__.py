"""The identification algorithms: one file each, and one line here."""

from workbench.identification.algorithms.identifier import AbstractIdentifier
from workbench.identification.algorithms.influence_based import InfluenceBased
from workbench.identification.algorithms.ols import Ols
from workbench.identification.algorithms.opt1_bounded import Opt1
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2

ALGORITHMS: dict[str, AbstractIdentifier] = {
    each.name: each for each in (Ols(), Opt1(), Opt2(), InfluenceBased())
}
"""The identification algorithms by their names in files and commands."""
DEFAULT_ALGORITHMS = ("ols",)
"""What runs by default …"""
FURTHER_ALGORITHMS = ("opt1", "opt2")
"""… and what runs beside it where it does not converge."""

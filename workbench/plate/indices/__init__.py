"""Indices: O of single poses, O1 … O5, A, D of a set, I over a region; a new one is a file and a line."""

from collections.abc import Mapping
from types import MappingProxyType

from workbench.arm.linearisation import Linearisation
from workbench.base.errors import OptionError
from workbench.plate.indices.a import A
from workbench.plate.indices.d import D
from workbench.plate.indices.i import I
from workbench.plate.indices.index import AbstractIndex, AbstractSetIndex
from workbench.plate.indices.o import O
from workbench.plate.indices.o1 import O1
from workbench.plate.indices.o2 import O2
from workbench.plate.indices.o3 import O3
from workbench.plate.indices.o4 import O4
from workbench.plate.indices.o5 import O5

INDICES: Mapping[str, AbstractIndex] = MappingProxyType(
    {index.name: index for index in (O(), O1(), O2(), O3(), O4(), O5(), A(), D())}
)
"""Every index by name that needs no region; `I` is made for one."""


def index_named(name: str, indices: Mapping[str, AbstractIndex] = INDICES) -> AbstractIndex:
    """The index of that name.

    Raises:
        OptionError: there is none.
    """
    if name not in indices:
        raise OptionError(f"there is no index '{name}'; known are {', '.join(indices)}")
    return indices[name]


def evaluate(
    linearisation: Linearisation, indices: Mapping[str, AbstractIndex] = INDICES
) -> dict[str, float]:
    """Every index of a linearisation, by name; the singular values are computed once."""
    return {name: index.value(linearisation) for name, index in indices.items()}


__all__ = [
    "INDICES",
    "O1",
    "O2",
    "O3",
    "O4",
    "O5",
    "A",
    "AbstractIndex",
    "AbstractSetIndex",
    "D",
    "I",
    "O",
    "evaluate",
    "index_named",
]

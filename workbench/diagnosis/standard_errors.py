"""Standard errors of a diagnosis' coefficients, with what hides in them."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from jaxtyping import Float

from workbench.identification.fit import Fit


class StandardErrors(Mapping[str, float]):
    """Of a fit's unknowns by name [SI].

    Args:
        fit: The saved arm's.
        hidden: What effects that are lost in the noise add to the variance of its unknowns [SI²].
    """

    def __init__(self, fit: Fit, hidden: Mapping[str, float]):
        self._places = {name: i for i, name in enumerate(fit.problem.names)}
        own = fit.std
        more = np.sqrt([hidden.get(name, 0.0) for name in self._places])
        self._covariance, self._std = fit.covariance, np.hypot(own, more)
        self._ratio = self._std / np.where(own > 0.0, own, 1.0)

    def __getitem__(self, name: str) -> float:
        return float(self._std[self._places[name]])

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def covariance(self, names: Sequence[str]) -> Float[np.ndarray, "k k"]:
        """Of some unknowns [SI²], with these standard errors."""
        mine = [self._places[n] for n in names]
        return self._covariance[np.ix_(mine, mine)] * np.outer(self._ratio[mine], self._ratio[mine])

"""An older result as prior knowledge: the covariance of the arm's constants, from its JSON file.

Base and tool are left out, as the arm may stand elsewhere by now, and so are the places of instruments.
A joint that was replaced is left out too: nothing is known of it any more, and a few poses find it again.
"""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.errors import FileError, OptionError
from workbench.identify.result import Fit
from workbench.parameters import Parameter

INSTRUMENT = re.compile(r"marker\d*\.|anchor\[|contact\[")


def prior_json(fit: Fit) -> dict[str, Any]:
    """What `read_prior` needs of a fit: names and covariance [rad, m] of its parameters."""
    names = list(fit.problem.names)
    return {"covariance": {"algorithm": fit.algorithm, "names": names, "matrix": fit.covariance.tolist()}}


def read_prior(
    path: Path | str, *, renew: Sequence[int] = ()
) -> tuple[tuple[str, ...], Float[np.ndarray, "k k"]]:
    """Names and covariance [rad, m] of an older calibration of the same robot.

    Args:
        path: A result that `identify --json` wrote.
        renew: Joints of which nothing is known any more, counted from 1.

    Raises:
        FileError: not such a file, or one without a covariance.
        OptionError: a joint to renew that the result does not have, or nothing left to know.
    """
    try:
        found = json.loads(Path(path).read_text(encoding="utf-8"))["covariance"]
        names, matrix = [str(n) for n in found["names"]], np.array(found["matrix"], float)
    except OSError as error:
        raise FileError(error.strerror or "can't be read", path=str(path)) from None
    except (ValueError, KeyError, TypeError, UnicodeError):
        raise FileError(
            "is no result with a covariance; give the file that 'workbench identify --json' wrote",
            path=str(path),
        ) from None
    if matrix.shape != (len(names), len(names)) or not np.isfinite(matrix).all():
        raise FileError(
            f"names {len(names)} parameters, but its covariance is {matrix.shape}", path=str(path)
        )
    for joint in renew:
        if not any(n.startswith(f"joint{joint}.") for n in names):
            raise OptionError(f"{path}: nothing is known of joint {joint}, so it can't be renewed")
    keep = [
        i
        for i, n in enumerate(names)
        if Parameter(n, "", 0.0).is_geometry
        and not INSTRUMENT.match(n)
        and not any(n.startswith(f"joint{joint}.") for joint in renew)
    ]
    if not keep:
        raise OptionError(f"{path}: nothing of the arm is left as prior knowledge")
    return tuple(names[i] for i in keep), matrix[np.ix_(keep, keep)]

"""An older result as prior knowledge of the arm: written with every result, read by the next calibration.

Base, tool and the places of instruments are left out, as the arm may stand elsewhere by now; so is a joint
that was replaced, and a few poses find it again.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import FileError, OptionError
from workbench.base.files import read_bytes
from workbench.base.toml import LARGEST_FILE
from workbench.identification.fit import Fit
from workbench.identification.prior import Prior

KEY = "prior"
"""Key of the result file under which the next calibration finds it."""


def prior_json(fit: Fit) -> dict[str, Any]:
    """Names, values and information [1/rad², 1/m²] of the arm's constants as plain data."""
    prior = Prior.of(fit)
    return {
        KEY: {
            "names": list(prior.names),
            "values": prior.values.tolist(),
            "information": prior.information.tolist(),
        }
    }


def read_prior(path: Path | str, *, renew: Sequence[int] = ()) -> Prior:
    """What an older calibration of the same robot knows.

    Args:
        path: A result that `identify --json` wrote.
        renew: Joints of which nothing is known any more, counted from 1.

    Raises:
        FileError: not such a file, or one that contradicts itself.
        OptionError: a joint to renew that the result does not have, or nothing left to know.
    """
    wanted = "the file that 'workbench identify --json' wrote"
    content = read_bytes(path, wanted=wanted, most=LARGEST_FILE)
    try:
        found = json.loads(content)[KEY]
        names = tuple(str(name) for name in found["names"])
        values, information = np.array(found["values"], float), np.array(found["information"], float)
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        raise FileError(f"is no result with prior knowledge; give {wanted}", path=str(path)) from None
    count = len(names)
    shapes = values.shape == (count,) and information.shape == (count, count)
    if not shapes or not np.isfinite(values).all() or not np.isfinite(information).all():
        raise FileError(f"names {count} constants, but not as many numbers for them", path=str(path))
    for joint in renew:
        if not any(name.startswith(f"joint{joint}.") for name in names):
            raise OptionError(f"{path}: nothing is known of joint {joint}, so it can't be renewed")
    gone = tuple(f"joint{joint}." for joint in renew)
    prior = Prior(names, values, information).keep(lambda name: not name.startswith(gone))
    if not prior.names:
        raise OptionError(f"{path}: nothing of the arm is left as prior knowledge")
    return prior

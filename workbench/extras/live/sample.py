"""Reading samples of a live source, one JSON object per line.

    {"time": 12.3, "q": [0.1, …], "xyz": [0.4, 0.1, 0.3], "quat": [1, 0, 0, 0], "capture": true}

All in SI; the quaternion is (w, x, y, z). `xyz` and `quat` may be left out or null.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float
from pydantic import Field, FiniteFloat, TypeAdapter, ValidationError

from workbench.base import se3
from workbench.base.errors import FileError
from workbench.base.types import frozen

NORM_TOLERANCE = 0.01
"""A quaternion whose norm differs from 1 by more than this is refused."""
LONGEST_LINE = 65536
"""Maximum number of characters of a line."""
Three = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
Four = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]


@dataclass(frozen=True, eq=False, kw_only=True)
class Sample:
    """What a live source says at one time.

    Args:
        time: Time [s], by the source's clock.
        q: Joint positions [rad or m].
        position: Measured position of the tool point [m], measuring frame; None when not seen.
        rotation: Measured orientation; None when not seen.
        capture: Whether the source asks to keep this sample.
    """

    time: float
    q: Float[np.ndarray, " n"]
    position: Float[np.ndarray, "3"] | None = None
    rotation: Float[np.ndarray, "3 3"] | None = None
    capture: bool = False

    @classmethod
    def of(cls, line: Any) -> "Sample":
        """From plain numbers by the names of a line."""
        return cls(
            time=line.time,
            q=frozen(np.array(line.q)),
            position=None if line.xyz is None else frozen(np.array(line.xyz)),
            rotation=None if line.quat is None else frozen(se3.quaternion_to_matrix(np.array(line.quat))),
            capture=bool(line.capture),
        )

    def plain(self) -> dict[str, Any]:
        """As plain numbers by the names of a line, without what is missing."""
        quat = None if self.rotation is None else se3.matrix_to_quaternion(self.rotation)
        parts = {"q": self.q, "xyz": self.position, "quat": quat}
        plain = {name: tuple(part.tolist()) for name, part in parts.items() if part is not None}
        return {"time": self.time, **plain, **({"capture": True} if self.capture else {})}


@dataclass(frozen=True)
class _Line:
    """The schema of a line."""

    time: FiniteFloat
    q: Annotated[list[FiniteFloat], Field(min_length=1)]
    xyz: Three | None = None
    quat: Four | None = None
    capture: bool | None = None


@cache
def _schema() -> TypeAdapter[_Line]:
    return TypeAdapter(_Line)


def parse_sample(text: str, *, line: int, source: str = "stream") -> Sample:
    """One line of a live source.

    Args:
        text: A JSON object.
        line: Its number, for messages.
        source: Name of the source, for messages.
    """
    if len(text) > LONGEST_LINE:
        raise FileError(f"the line has more than {LONGEST_LINE} characters", path=source, line=line)
    try:
        found = _schema().validate_json(text, strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        column = str(first["loc"][0]) if first["loc"] else None
        wanted = f'\'{text.strip()[:40]}\' is no sample like {{"time": 0.1, "q": [0.0]}}: {first["msg"]}'
        raise FileError(wanted, path=source, line=line, column=column) from None
    norm = float(np.linalg.norm(found.quat or (1.0,)))
    if abs(norm - 1.0) > NORM_TOLERANCE:
        wanted = f"the norm of [w, x, y, z] must be 1, got {norm:.4g}"
        raise FileError(wanted, path=source, line=line, column="quat")
    return Sample.of(found)


def samples(lines: Iterable[str], *, source: str, on_error: Callable[[FileError], None]) -> Iterator[Sample]:
    """Samples of a source, as they come; blank lines are passed over, bad ones told."""
    for number, text in enumerate(lines, start=1):
        if text.strip():
            try:
                yield parse_sample(text, line=number, source=source)
            except FileError as error:
                on_error(error)

"""Reading and writing samples of a live source, one JSON object per line.

    {"time": 12.3, "q": [0.1, …], "xyz": [0.4, 0.1, 0.3], "quat": [1, 0, 0, 0], "capture": true}

All in SI; the quaternion is (w, x, y, z). `xyz` and `quat` may be left out or null.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TypeGuard

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.base.errors import FileError, ShapeError, WorkbenchError
from workbench.base.types import frozen

NORM_TOLERANCE = 0.01
"""A quaternion whose norm differs from 1 by more than this is refused."""
LONGEST_LINE = 65536
"""Maximum number of characters of a line."""

Fail = Callable[..., FileError]


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


def parse_sample(text: str, *, line: int, joints: int | None = None, source: str = "stream") -> Sample:
    """One line of a live source.

    Args:
        text: A JSON object.
        line: Its number, for messages.
        joints: Number of joints of the robot; None: any.
        source: Name of the source, for messages.
    """
    fail: Fail = partial(FileError, path=source, line=line)
    if len(text) > LONGEST_LINE:
        raise fail(f"the line has more than {LONGEST_LINE} characters")
    try:
        record = json.loads(text)
    except (ValueError, RecursionError):
        raise fail(f'\'{text.strip()[:40]}\' is not a JSON object like {{"time": 0.1, "q": [0.0]}}') from None
    if not isinstance(record, dict):
        raise fail("the line must be a JSON object {…}")
    if (q := _vector(record, "q", None, fail)) is None:
        raise fail('the joint positions are missing: send "q": […] in rad')
    if joints is not None and len(q) != joints:
        raise ShapeError(
            f"{source}, line {line}: the sample has {len(q)} joints, the robot {joints}",
            expected=joints,
            found=len(q),
        )
    time, capture = record.get("time"), record.get("capture")
    if not _is_number(time):
        raise fail("it must be a finite number of seconds", column="time")
    position, quaternion = _vector(record, "xyz", 3, fail), _vector(record, "quat", 4, fail)
    if not (capture is None or isinstance(capture, bool)):
        raise fail("it must be true or false", column="capture")
    return Sample(
        time=float(time),
        q=q,
        position=position,
        rotation=None if quaternion is None else _rotation(quaternion, fail),
        capture=bool(capture),
    )


def _vector(record: dict, key: str, length: int | None, fail: Fail) -> np.ndarray | None:
    """A list of finite numbers, or None when it is absent."""
    value = record.get(key)
    if value is None:
        return None
    if not isinstance(value, list) or not value or length not in (None, len(value)):
        raise fail(f"it must be a list of {'' if length is None else f'{length} '}numbers", column=key)
    if not all(_is_number(v) for v in value):
        raise fail("every value must be a finite number", column=key)
    return frozen(np.array(value, dtype=float))


def _is_number(value) -> TypeGuard[float | int]:
    return isinstance(value, float | int) and not isinstance(value, bool) and abs(value) < 1e300


def _rotation(quaternion: np.ndarray, fail: Fail) -> np.ndarray:
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > NORM_TOLERANCE:
        raise fail(f"the norm of [w, x, y, z] must be 1, got {norm:.4g}", column="quat")
    return frozen(se3.quaternion_to_matrix(quaternion))


def format_sample(sample: Sample) -> str:
    """A sample as the line of a live source, without its end; `parse_sample` reads it back."""
    record: dict = {"time": sample.time, "q": sample.q.tolist()}
    if sample.position is not None:
        record["xyz"] = sample.position.tolist()
    if sample.rotation is not None:
        record["quat"] = se3.matrix_to_quaternion(sample.rotation).tolist()
    if sample.capture:
        record["capture"] = True
    return json.dumps(record)


def samples(
    lines: Iterable[str],
    *,
    joints: int | None = None,
    source: str = "stdin",
    on_error: Callable[[WorkbenchError], None],
) -> Iterator[Sample]:
    """Samples of a source, as they come; blank lines are passed over, bad ones told."""
    for number, text in enumerate(lines, start=1):
        if text.strip():
            try:
                yield parse_sample(text, line=number, joints=joints, source=source)
            except WorkbenchError as error:
                on_error(error)

"""LeRobot data sets: `meta/info.json` and parquet files with `observation.state`, `action`, `timestamp`.

Version 2 has a file for each episode, version 3 several episodes in a file; the columns are the same. A
column holds all motors of a frame; their names are in `meta/info.json`, such as `shoulder_pan.pos`.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import DataError, FileError
from workbench.data.binary_tables import read_columns
from workbench.data.readers.file_kind import read_bytes

STATE, ACTION = "observation.state", "action"
GRIPPER = "gripper"
"""The motor that is no joint of the arm, at the end of LeRobot's names."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MotorLog:
    """Motors over time, in the file's units.

    Args:
        source: For messages.
        names: Of the motors, without `.pos`.
        time: Of each frame since the first of its episode [s].
        episode: Its number.
        state: What was read.
        action: What was commanded: in teleoperation what the leader read; None if not recorded.
    """

    source: str
    names: tuple[str, ...]
    time: Float[np.ndarray, " frames"]
    episode: Int[np.ndarray, " frames"]
    state: Float[np.ndarray, "frames motors"]
    action: Float[np.ndarray, "frames motors"] | None = None

    @property
    def joints(self) -> list[int]:
        """Motors but the gripper."""
        return [k for k, name in enumerate(self.names) if name != GRIPPER]


def root_of(path: Path) -> Path | None:
    """The folder of the data set that a path is or lies in; None if it is no data set."""
    places = (path, *path.parents[:4]) if path.suffix == ".parquet" or path.is_dir() else ()
    return next((place for place in places if (place / "meta" / "info.json").is_file()), None)


def read_data_set(path: Path) -> MotorLog:
    """The frames of a data set, or of one of its parquet files."""
    root = root_of(path)
    if root is None:
        raise FileError("is not a LeRobot data set: there is no meta/info.json", path=str(path))
    features = _features(root / "meta" / "info.json")
    files = [path] if path.is_file() else sorted((root / "data").rglob("*.parquet"))
    if not files:
        raise FileError("has no parquet file below data/", path=str(root))
    parts: dict[str, list[Any]] = {}
    for file in files:
        names, columns = read_columns(read_bytes(file), file)
        if lacking := [key for key in (STATE, "timestamp") if key not in names]:
            raise FileError(f"has no column {lacking[0]}", path=str(file))
        for name, cells in zip(names, columns, strict=True):
            parts.setdefault(name, []).extend(cells)
    frames = len(parts[STATE])
    state = _rows(parts[STATE], root)
    return MotorLog(
        source=str(path),
        names=_names(features, state.shape[1]),
        time=np.array(parts["timestamp"], float),
        episode=np.array(parts.get("episode_index", [0] * frames), float).astype(int),
        state=state,
        action=_rows(parts[ACTION], root) if len(parts.get(ACTION, ())) == frames else None,
    )


def _features(path: Path) -> Mapping[str, Any]:
    try:
        features = json.loads(read_bytes(path))["features"]
        if STATE in features:
            return features
    except (ValueError, KeyError, TypeError):
        pass
    raise FileError(f"is not a LeRobot meta/info.json with the feature {STATE}", path=str(path))


def _names(features: Mapping[str, Any], count: int) -> tuple[str, ...]:
    names = features[STATE].get("names")
    if isinstance(names, dict):
        names = list(chain.from_iterable(names.values()))
    if not isinstance(names, list) or len(names) != count:
        names = [f"motor{k + 1}" for k in range(count)]
    return tuple(str(name).removesuffix(".pos").removeprefix("main_") for name in names)


def _rows(cells: list[str], root: Path) -> Float[np.ndarray, "frames motors"]:
    try:
        rows = np.array([json.loads(cell) for cell in cells], float)
    except ValueError:
        rows = np.zeros(0)
    if rows.ndim != 2 or not np.isfinite(rows).all():
        raise DataError(f"{root}: frames without numbers, or of different motors; record the data set again")
    return rows

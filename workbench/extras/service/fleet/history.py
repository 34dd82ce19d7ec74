"""The calibrations of one arm over time, read from a folder.

    fleet/
        arm-17/
            2026-01-10.toml      a calibrated robot, as `identify --save` writes it
            2026-04-02.csv       or measurements, identified here with the nominal robot

A folder holds one folder an arm; one that holds such files itself is a single arm. A file's name begins with
its date; `2026-04-02-after-crash.toml` is of the same day and later in the alphabet. What is compared are the
arm's own constants for which every calibration states a standard error; base and tool may change.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot import Robot
from workbench.base.errors import FileError, OptionError, WorkbenchError
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.data.readers import read_measurements
from workbench.identification.identify import identify

ROBOTS, MEASUREMENTS = (".toml",), (".csv", ".tsv", ".xlsx", ".parquet")
NOT_THE_ARM = ("base.", "tool.")


@dataclass(frozen=True, eq=False, kw_only=True)
class History:
    """The calibrations of one arm, in the order of their dates.

    Args:
        arm: Name of its folder.
        dates: Day of each calibration.
        names: Constants that all of them state.
        values: Their values, in SI.
        std: Their standard errors.
        robot: The arm as it was calibrated last.
    """

    arm: str
    dates: tuple[date, ...]
    names: tuple[str, ...]
    values: Float[np.ndarray, "dates p"]
    std: Float[np.ndarray, "dates p"]
    robot: Robot

    @property
    def days(self) -> Float[np.ndarray, " dates"]:
        return np.array([(day - self.dates[0]).days for day in self.dates], float)


@dataclass(frozen=True)
class Unread:
    """An arm whose calibrations can't be compared.

    Args:
        arm: Name of its folder.
        why: One sentence.
    """

    arm: str
    why: str


def arms_of(folder: Path | str) -> dict[str, tuple[Path, ...]]:
    """Files of every arm in a folder, by name, in the order of their dates."""
    folder = Path(folder)
    if not folder.is_dir():
        raise FileError("is not a folder; give one with a folder for each arm", path=str(folder))
    if own := _files(folder):
        return {folder.resolve().name: own}
    found = {path.name: _files(path) for path in sorted(folder.iterdir()) if path.is_dir()}
    if not any(found.values()):
        raise FileError("holds no calibrations such as ARM/2026-01-31.toml or .csv", path=str(folder))
    return {name: files for name, files in found.items() if files}


def _files(folder: Path) -> tuple[Path, ...]:
    known = (*ROBOTS, *MEASUREMENTS)
    return tuple(sorted(p for p in folder.iterdir() if p.suffix.lower() in known and p.is_file()))


@one_thread()
def read_histories(
    arms: Sequence[tuple[str, tuple[Path, ...]]], robot: Robot | None
) -> list[History | Unread]:
    """Histories of some arms: a piece of work for a worker.

    Args:
        arms: Name and files of each.
        robot: Nominal arm with which measurements are identified.
    """
    found: list[History | Unread] = []
    for name, files in arms:
        try:
            found.append(_history(name, files, robot))
        except WorkbenchError as error:
            found.append(Unread(name, str(error)))
    return found


def _history(arm: str, files: Sequence[Path], robot: Robot | None) -> History:
    """One arm's history."""
    dates = [_date(path) for path in files]
    robots = [_calibrated(path, robot) for path in files]
    stated = []
    for path, calibrated in zip(files, robots, strict=True):
        if calibrated.calibration is None or not calibrated.calibration.std:
            raise FileError(
                "states no standard errors of its constants: save it again with identify --save, or give its "
                "measurements",
                path=str(path),
            )
        stated.append(calibrated.calibration.std)
    names = tuple(
        name
        for name in stated[-1]
        if not name.startswith(NOT_THE_ARM) and "[" not in name and all(name in std for std in stated)
    )
    if not names:
        raise FileError(f"its {len(files)} calibrations have no constant in common", path=arm)
    return History(
        arm=arm,
        dates=tuple(dates),
        names=names,
        values=frozen(np.array([values_of(calibrated, names) for calibrated in robots])),
        std=frozen(np.array([[std[name] for name in names] for std in stated])),
        robot=robots[-1],
    )


def _calibrated(path: Path, robot: Robot | None) -> Robot:
    if path.suffix.lower() in ROBOTS:
        return load_robot(path)
    if robot is None:
        raise OptionError(f"{path}: measurements need the nominal robot (--robot)")
    data = read_measurements(path, joints=robot.joint_names, base=robot.base.pose)
    return identify(robot, data, algorithms=("opt2",), held_out=0.0).robot


def values_of(robot: Robot, names: Iterable[str]) -> list[float]:
    """Values of constants, coefficients and masses by name."""
    known = {**robot.coefficients, **robot.inertia}
    return [known[n] if n in known else float(robot.values((n,))[0]) for n in names]


def _date(path: Path) -> date:
    try:
        return date.fromisoformat(path.stem[:10])
    except ValueError:
        raise FileError("must begin with its date, such as 2026-01-31.toml", path=str(path)) from None

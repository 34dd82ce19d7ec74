"""Choices for a fit, for identification and diagnosis: rows, frames, free constants, noise."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, TypedDict

from workbench.arm.robot import Robot
from workbench.base.arguments import Reads, Seed, admit, pair_of
from workbench.base.errors import OptionError
from workbench.data.arguments import as_dataset
from workbench.data.dataset import Dataset
from workbench.identification.meaning.as_read import as_read
from workbench.identification.problem import Noise
from workbench.plate.arguments import RegionOf
from workbench.plate.plate import Plate
from workbench.plate.region import Region


class Sessions(StrEnum):
    """Whether base and tool may differ between sessions."""

    SHARED = "shared"
    PER_SESSION = "per-session"
    AUTO = "auto"


def _held_out(value: Any, given: Any) -> Any:
    """A share, a file or sessions from text, as in `--held-out`."""
    share = value
    with suppress(ValueError, AttributeError):  # 0.2 or 20%
        share = float(value.strip().removesuffix("%")) / (100.0 if value.strip().endswith("%") else 1.0)
    if isinstance(share, int | float) and not 0.0 <= share < 1.0:
        wrong = f"the held-out fraction must be at least 0 and less than 1, got {share:g}"
        raise OptionError(wrong, option="held_out", found=share)
    if not isinstance(share, str):
        return as_dataset(share)
    if share.startswith("session:"):
        return share.removeprefix("session:").split(",")
    return as_dataset(share) if Path(share).suffix else (share,)


def _by_hand(value: Any, given: Any) -> Any:
    """Excluded rows with the reason given for each, or one reason for all; ranges may have messages' dash."""
    if value is None or isinstance(value, Mapping):
        return value or {}
    if isinstance(value, str):
        ends = [part.replace("–", "-").split("-") for part in value.split(",") if part.strip()]
        value = [row for first, *last in ends for row in range(int(first), int([first, *last][-1]) + 1)]
    return dict.fromkeys(value if isinstance(value, Iterable) else [value], "by hand")


MAX_NOISE = 0.02
"""Noise [m] above which a number without a unit is taken for mm, and refused."""


def _noise(value: Any, given: Any) -> Any:
    if isinstance(value, str) and not any(map(str.isalpha, value)):
        text = f"noise '{value}' has no unit; write '{value.partition(',')[0]}mm', or '0.05mm,0.01deg'"
        raise OptionError(text, option="noise", found=value)
    if (pair := pair_of(value)) is not None and not isinstance(value, str) and pair[0] > MAX_NOISE:
        wrong = f"noise is in m: {pair[0]:g} would be {1e3 * pair[0]:g} mm; write '{pair[0]:g}mm', or a Noise"
        raise OptionError(wrong, option="noise", found=value)
    noise = value if pair is None else Noise(pair[0]) if len(pair) == 1 else Noise(pair[0], pair[1])
    if not isinstance(noise, Noise):
        return noise
    joints = noise.joints if isinstance(noise.joints, tuple | list) else (None,)
    sizes = (noise.position, noise.rotation, noise.own, noise.tilt)
    numbers = all(isinstance(size, Real) for size in (*sizes, *joints))
    if not numbers or min(joints, default=0.0) < 0.0 or any(size <= 0.0 for size in sizes):  # NaN: open
        wrong = f"noise must be positive standard deviations, got {value}"
        raise OptionError(wrong, option="noise", found=value)
    return noise


NoiseLike = Annotated[
    Noise, Reads('a length in m and an angle in rad, or text with units such as "0.05mm,0.01deg"', _noise)
]
HeldOut = Annotated[
    float | Dataset | tuple[str, ...],
    Reads('a share such as 0.2 or "20%", a Dataset, a file, or names of sessions', _held_out),
]
Excluded = Annotated[
    Mapping[int, str], Reads('rows such as [3, 4] or "3,21-37", or a mapping of rows to reasons', _by_hand)
]
"""Rows to exclude, with the reason; without reasons they count as excluded by hand."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FitChoices:
    """Which rows are fitted, which constants are free, and how rows are weighted.

    Args:
        held_out: Share of rows to hold out, rows of another file, or names of sessions; they choose nothing.
        frames: Whether sessions share base and tool, have their own, or the data decide.
        free: Constants to identify; the robot's default ones if None.
        exclude: Rows to exclude, with the reason.
        region: Keep only rows whose nominal tool position lies in this cuboid of the robot's base frame.
        noise: Standard deviations [m], [rad]; from repeats or the fit if None.
        levelled: Whether the z axis of the measuring frame is vertical, so that the base's orientation in it
            gives the direction of gravity.
        known: Known places of anchors or contacts [m], such as `anchor[A].x`.
        reading: What rows mean that fit far better in another reading: `auto` applies conventions of
            orientation and refuses other signs, zeros, couplings, orders and units; `found`, or the name of
            one of several that fit alike, applies these, too; `given` takes the rows as they are.
        seed: Chooses the held-out rows (and the folds of a diagnosis).
    """

    held_out: HeldOut = 0.2
    frames: Sessions | str = Sessions.AUTO
    free: Sequence[str] | None = None
    exclude: Excluded = field(default_factory=dict)
    region: RegionOf | None = None
    noise: NoiseLike | None = None
    levelled: bool = False
    known: Mapping[str, float] = field(default_factory=dict)
    reading: str = "auto"
    seed: Seed = 0

    def __post_init__(self):
        admit(self)


def choices_as_read(robot: Robot, choices: FitChoices) -> FitChoices:
    """The choices with the rows of another file, if those are held out, in the reading that is theirs."""
    held = choices.held_out
    if not isinstance(held, Dataset):
        return choices
    return replace(choices, held_out=as_read(robot, held, choices.reading, keeps_arm=True)[1])


class ChoiceFields(TypedDict, total=False):
    """The fields of `FitChoices` as keyword arguments, for type checkers and editors."""

    held_out: float | str | Path | Dataset | Sequence[str]
    frames: Sessions | str
    free: Sequence[str] | None
    exclude: Mapping[int, str] | Sequence[int]
    region: Region | Plate | str | None
    noise: Noise | tuple[float, float] | float | str | None
    levelled: bool
    known: Mapping[str, float]
    reading: str
    seed: int

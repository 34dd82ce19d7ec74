"""Measurements of a session, and what was understood of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.readers.preview import Preview
from workbench.identification.arm_match import ArmMatch


@dataclass(frozen=True, eq=False)
class MeasurementFile:
    """A file as its columns were understood, whether it could be read so or not.

    Args:
        name: Its name.
        content: Its bytes.
        preview: What was understood.
        mapping: What its columns were said to be (TOML); empty: as its headings say.
    """

    name: str
    content: bytes
    preview: Preview
    mapping: bytes = b""


@dataclass(frozen=True, eq=False)
class Loaded:
    """Measurements, and what was understood of them.

    Args:
        dataset: The rows.
        name: File name, or how they came to be.
        facts: Pairs of a heading and what was understood.
        notes: Decisions that the reader took, one sentence each.
        virtual: Whether a virtual arm made them.
        checks: Rows that are measured for checking only and never fitted.
        actual: The virtual arm that was measured, hidden from every computation.
        read: The rows as they were read, before anything was said of them for an arm; None: virtual ones.
        match: How well they and the arm go together; None: not asked.
        pictures: Small JPEG of every picture, by camera and image.
        file: Where they were read; None: virtual ones.
    """

    dataset: Dataset
    name: str
    facts: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    virtual: bool = False
    checks: Dataset | None = None
    actual: Robot | None = None
    read: Dataset | None = None
    match: ArmMatch | None = None
    pictures: Mapping[tuple[str, str], bytes] = field(default_factory=dict)
    file: MeasurementFile | None = None

    @property
    def is_foreign(self) -> bool:
        """Whether these are clearly another arm's rows."""
        return self.match is not None and self.match.is_foreign

"""The sample session of the repository, and what its pictures say when they are read back."""

import shutil
import warnings
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from workbench.session.journal.reader import Recording, read_recording
from workbench.session.journal.replay import Restored, restore

SAMPLE = Path(__file__).resolve().parents[1] / "recordings" / "sample"


@dataclass
class Pictures:
    """A file of pictures, read with rerun's own reader."""

    paths: set[str] = field(default_factory=set)
    static: set[str] = field(default_factory=set)
    timelines: set[str] = field(default_factory=set)
    batches: dict[str, list[Any]] = field(default_factory=lambda: defaultdict(list))

    def values(self, path: str, column: str, timeline: str = "step") -> list[tuple[int, Any]]:
        """Pairs of time and value, in the order of time."""
        import pyarrow as pa

        found = []
        for batch in self.batches[path]:
            names = batch.schema.names
            if timeline in names and column in names:
                times = batch.column(timeline).cast(pa.int64()).to_pylist()  # steps, or nanoseconds
                values = batch.column(column).to_pylist()
                found += [(t, v) for t, v in zip(times, values, strict=True) if v is not None]
        return sorted(found, key=lambda pair: pair[0])


def read(path: Path) -> Pictures:
    """All chunks of a file."""
    from rerun.chunk import RrdReader

    found = Pictures()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a file has no index
        for chunk in RrdReader(path).stream():
            found.paths.add(chunk.entity_path)
            if chunk.is_static:
                found.static.add(chunk.entity_path)
            found.timelines |= set(chunk.timeline_names)
            found.batches[chunk.entity_path].append(chunk.to_record_batch())
    return found


@pytest.fixture(scope="session")
def reader() -> Callable[[Path], Pictures]:
    return read


@pytest.fixture(scope="session")
def sample() -> Recording:
    return read_recording(SAMPLE)


@pytest.fixture
def copy(sample, tmp_path) -> Path:
    return shutil.copytree(sample.folder, tmp_path / "copy")


@pytest.fixture(scope="session")
def replayed(sample) -> Restored:
    return restore(sample, is_computed=True)

"""What tests of files share."""

import pytest
from binary_files import read_here, read_once  # noqa: F401


@pytest.fixture
def file(tmp_path):
    """Writes a file."""

    def write(content, name="rows.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write

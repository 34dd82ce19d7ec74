"""What tests of files share."""

from binary_files import read_here, read_once  # noqa: F401

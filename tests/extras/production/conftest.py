"""The plate of the core's tests."""

from tests.plate.conftest import plate  # noqa: F401

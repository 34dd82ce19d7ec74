"""The plate of the ARIA paper."""

from tests.plate.conftest import plate, solutions

__all__ = ["plate", "solutions"]

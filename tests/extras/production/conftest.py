"""Plates of the core's tests."""

from tests.plate.conftest import plate, solutions

__all__ = ["plate", "solutions"]

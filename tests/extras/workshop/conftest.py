"""Plates of the core's tests, to be made."""

from tests.plate.conftest import _plate_of, fixture, made_plate, mixed, plate

__all__ = ["_plate_of", "fixture", "made_plate", "mixed", "plate"]

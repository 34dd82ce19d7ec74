"""What drawings and lists say of holes: purposes, positions, threads, and lengths as they are sold."""

from collections.abc import Sequence

from workbench.plate.parts.parts import Bore, Fixture, Purpose
from workbench.plate.tolerances import Tolerances

MM = 1e3
BOTTOM = "EN AW-5083"
STEEL = "C45"
RADIAL = 0.01
"""± of an index hole's distance from the seat [mm]."""
UPRIGHT = 0.005
"""How far a seat or an index hole may lean over its depth [mm]."""
FLAT = 1e-6
"""A face that slopes less has no low side [rad]."""
SHORT_OF = 2.0
"""Threads and screws end so far above the bottom of their hole [mm]."""
SCREWS = (8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0)
"""Lengths in which ISO 4762 and ISO 4026 sell M6 and M8 [mm]."""
DOWELS = (10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 24.0, 28.0, 32.0, 36.0, 40.0)
"""Lengths in which ISO 8734 sells Ø4 [mm]."""
LENGTH = 0.02
"""± of the probe's length, which is the tool's [mm]."""
PIN_PLACE = 0.01
"""Diameter in which the probe's pins lie [mm]."""


def millimetres(value: float) -> str:
    """A length in metres as a number of millimetres."""
    return f"{MM * value:z.3f}"


SHORT = {
    Purpose.SCREW: "screw",
    Purpose.THREAD: "screw",
    Purpose.DOWEL: "dowel",
    Purpose.MOUNTING: "mounting",
    Purpose.SEAT: "probe seat",
    Purpose.INDEX: "index pin",
    Purpose.SOCKET: "ball",
    Purpose.TIP: "pointed probe",
    Purpose.MAGNET: "magnet",
    Purpose.PIN: "dowel pin",
    Purpose.FLANGE: "flange screw",
    Purpose.STANDOFF: "stand-off",
    Purpose.ROBOT: "robot's foot",
}


def position_words(bore: Bore, tolerances: Tolerances) -> str:
    """Position tolerance of a bore, with its datums."""
    across = 2.0 * MM * tolerances.place
    match bore.purpose:
        case Purpose.SEAT | Purpose.SOCKET | Purpose.TIP:
            return f"Ø{across:.3f} to A B C"
        case Purpose.INDEX:
            return f"by angle; radius ±{RADIAL:g}"
        case Purpose.DOWEL:
            return f"Ø{MM * tolerances.pair:.3f} to each other"
        case Purpose.PIN:
            return f"Ø{PIN_PLACE:g} to the axis"
    return f"Ø{max(across, 0.2):.3g}"


def thread_notes(bores: Sequence[Bore]) -> list[str]:
    """How deep threads are cut, where there are any."""
    if not any(bore.size.startswith("M") and not bore.through for bore in bores):
        return []
    return [f"Depth of a thread: its core's; the thread ends {SHORT_OF:g} above the bottom."]


def longest(sold: Sequence[float], room: float) -> float:
    """The longest one sold that has room, or the shortest [mm]."""
    return max((length for length in sold if length <= room + 1e-6), default=min(sold))


def dowel_length(fixture: Fixture) -> float:
    """Length of the pins through the plate into a block [mm]."""
    return longest(DOWELS, MM * (fixture.slab.size[2] + fixture.stock.dowel_depth))

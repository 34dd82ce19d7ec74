"""Stock: the bar, screws, pins and standard sizes that the parts are made with."""

from dataclasses import dataclass, replace

import numpy as np

from workbench.base.types import frozen
from workbench.plate.plate import Kind, Plate
from workbench.plate.tolerances import Production, pin_play, tolerances_of

UP = frozen(np.array([0.0, 0.0, 1.0]))
OVER_SCREW = "the ball's centre lies over the block's screw: turning the block moves nothing, so no dowels"
DOWN = frozen(np.array([0.0, 0.0, -1.0]))


@dataclass(frozen=True, kw_only=True)
class Stock:
    """Bar, screws and pins that the blocks are made with; all lengths in metres.

    Args:
        side: Side of the square bar.
        thickness: Of the plate, where its file does not say.
        margin: Of the plate around the blocks, where its file does not say.
        clearance: Diameter of the screw's hole in the plate (M6).
        core: Diameter of the tapped hole in the block before the thread is cut.
        thread: Depth of the tapped hole.
        dowel: Diameter of the dowels.
        dowel_depth: How deep they go into the block.
        dowel_offset: Distance of each dowel from the screw.
        seat: Diameter of the bore for the probe's pin.
        seat_depth: Its depth.
        index: Diameter of the hole for the index pin.
        index_depth: Its depth.
        index_offset: Its distance from the seat along the tool's x axis.
        ball: Diameter of the ball that sits in sockets.
        magnet: Diameter of the magnet under the ball, and depth of its pocket from the face; none if None.
        centre: Diameter of the centre for a pointed probe.
        mounting: Diameter of the plate's mounting holes.
        inset: Distance of the mounting holes from both edges.
        probe: Length of the probe from the flange to its face.
        neck: Diameter of the probe.
        flange: Diameter of its flange, of the circle of its screws, and of their holes (ISO 9409-1-50-4-M6).
        bottom: Thickness of the plate under the robot.
        foot: Circle of the robot's foot screws and their holes (Ø132 and M8 for arms such as a UR10).
        post: Diameter of a stand-off, and of the core of its thread (M8) and how deep that is.
        fastener: What holds a block on the plate.
        doweled: Whether dowels keep the blocks from turning about their screws.
        bar: What the blocks are made from, for the drawings.
        sheet: What the plate is made from.
        surfaces: How the blocks' surfaces come out.
        notes: What whoever builds the plate has to know.
    """

    side: float = 0.046
    thickness: float = 0.012
    margin: float = 0.020
    clearance: float = 0.0066
    core: float = 0.005
    thread: float = 0.012
    dowel: float = 0.004
    dowel_depth: float = 0.008
    dowel_offset: float = 0.014
    seat: float = 0.006
    seat_depth: float = 0.008
    index: float = 0.003
    index_depth: float = 0.006
    index_offset: float = 0.015
    ball: float = 0.012
    magnet: tuple[float, float] | None = None
    centre: float = 0.003
    mounting: float = 0.009
    inset: float = 0.020
    probe: float = 0.060
    neck: float = 0.039
    flange: tuple[float, float, float] = (0.063, 0.050, 0.0066)
    bottom: float = 0.015
    foot: tuple[float, float] = (0.132, 0.009)
    post: tuple[float, float, float] = (0.030, 0.0068, 0.020)
    doweled: bool = True
    fastener: str = "screw ISO 4762 M6"
    bar: str = "square bar {side:.1f} mm, EN AW-6082"
    sheet: str = "EN AW-5083, milled flat to 0.05"
    surfaces: str = "surfaces Ra 3.2, foot and face Ra 1.6; edges broken 0.3"
    notes: tuple[str, ...] = ()

    @property
    def play(self) -> tuple[float, float]:
        """Maximum shift [m] and turn [rad] of a probe on g6 pins in a seat."""
        return pin_play(self.seat, self.index, self.index_offset)

    @property
    def tapped(self) -> bool:
        """Whether the plate's holes for the blocks are tapped, as a breadboard's are."""
        return self.clearance == self.core

    @classmethod
    def named(cls, made: str) -> "Stock":
        """The stock of a way to make plates (`optimiser.manufacturing`)."""
        return STOCKS.get(made, cls())

    @property
    def cone(self) -> tuple[float, float]:
        """Diameter and depth of the 90° cone for a ball, whose centre lies ¼ diameter over the face."""
        depth = (np.sqrt(2.0) - 0.5) * 0.5 * self.ball
        return 2.0 * depth, depth

    def lift(self, kind: Kind) -> float:
        """How far the face lies above the target along its normal [m]."""
        return {Kind.SEAT: 0.0, Kind.SOCKET: -0.25 * self.ball, Kind.POINT: 0.5 * self.centre}[kind]


MAGNET = (0.005, 0.0072)
STOCKS = {
    "printed": Stock(
        magnet=MAGNET,
        core=0.008,
        thickness=0.016,
        doweled=False,
        bar="printed block {side:.1f} mm square, PETG, foot down, 4 walls, 40 % infill",
        sheet="any flat board of this thickness, drilled: aluminium or plywood",
        surfaces="as printed; M6 thread insert pressed in hot, magnet 5 × 4 glued",
        notes=(OVER_SCREW, "the blocks are printed; plate and probe are machined"),
    ),
    "breadboard": Stock(
        magnet=MAGNET,
        doweled=False,
        clearance=0.005,
        fastener="set screw ISO 4026 M6",
        sheet="bought: optical breadboard, M6 holes 25 mm apart; used holes listed",
        notes=(
            "a hole of the breadboard lies at the plate's centre: shift a board whose middle lies "
            "between holes by half a pitch",
            OVER_SCREW,
        ),
    ),
    "ball-bar": Stock(magnet=MAGNET),
}
"""Stock of the ways to make plates that have one of their own: cones for balls over magnets Ø5 × 4."""


def made_as_drawn(plate: Plate, stock: Stock | None = None) -> Plate:
    """The plate with what its drawings ask for: their tolerances, and the play of the pins in its seats."""
    stock = stock or Stock()
    asked = tolerances_of(plate.production, stock.dowel_offset).production
    play = stock.play if plate.has_seats else (0.0, 0.0)
    return replace(plate, production=Production(position=asked.position, angle=asked.angle, play=play))

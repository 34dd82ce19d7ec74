"""Cost and accuracy of plates: predicted error by numbers of targets, shapes and ways to make them.

Every choice is a plate of its own, searched for and kept, so that whoever picks one has it. Choices stand in
the order of the work that they take; one is on the front if no other is both less work and better.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, final

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from workbench.arm.robot import Robot
from workbench.base.arguments import Seed
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import cancelled, check_cancelled, part_of
from workbench.data.accuracy_requirement import Wanted
from workbench.extras.production.plate_trial import try_plate
from workbench.extras.production.production_yield import Yield
from workbench.plate.design import optimise_plate
from workbench.plate.optimiser.manufacturing import METHODS
from workbench.plate.optimiser.optimise import DesignRequest
from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import Blocks
from workbench.plate.plate import Plate
from workbench.report.json import Json, document
from workbench.report.result_display import AbstractShown
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORK = ("printed", "breadboard", "machined", "ball-bar")
"""Ways to make plates, the cheapest first."""
FRONT_TEXT = "●: Pareto-optimal in work and error; open: a ball gives no orientation"
FEW_SHAPES = 3
"""Number of block shapes if few are requested."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Choice:
    """A plate that could be made.

    Args:
        method: Name of the method to make it.
        design: The plate with its predicted error.
        tried: How virtual arms did on it; None if not tried.
    """

    method: str
    design: PlateDesign
    tried: Yield | None = None

    @property
    def share(self) -> float | None:
        return None if self.tried is None else self.tried.share

    @property
    def shapes(self) -> int:
        return self.design.plate_shapes

    @property
    def work(self) -> tuple[int, int]:
        """To compare: the way it is made, then blocks and set-ups; a shape takes as much as a block."""
        return WORK.index(self.method), len(self.design.plate) + self.shapes

    @property
    def held(self) -> str:
        """What its error holds, and what to measure when it stands."""
        return f"{self.design.assumptions}; afterwards: {METHODS[self.method].afterwards}"

    @property
    def name(self) -> str:
        """For people and for its file."""
        return (
            f"{self.method}, {len(self.design.plate)} targets, {self.shapes} shape{'s' * (self.shapes != 1)}"
        )


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Tradeoff(AbstractShown):
    """All choices, the least work first, and why other requested ones are impossible."""

    choices: tuple[Choice, ...]
    missing: tuple[str, ...] = ()

    @property
    def front(self) -> tuple[Choice, ...]:
        """Choices than which none is both less work and better."""
        kept: list[Choice] = []
        for choice in self.choices:
            if not kept or choice.design.cost < kept[-1].design.cost:
                kept.append(choice)
        return tuple(kept)

    @property
    def _fields(self) -> ResultFields:
        """Of a choice."""
        return ResultFields(
            ResultField(
                "", of=lambda choice: f"{self.choices.index(choice) + 1}: {choice.name}", title="no., plate"
            ),
            "name",
            ResultField("made", of="method"),
            ResultField("targets", of=lambda choice: len(choice.design.plate)),
            "shapes",
            ResultField("position_rms", MM, of="design.cost", title="rms"),
            ResultField(
                "",
                DEG,
                of="design.rotation",
                title="rms",
                text=lambda v: f"{v:.3f}" if np.isfinite(v) else "open",
            ),
            ResultField("holds", of="design.assumptions"),
            "share",
            ResultField("share_95", of=lambda choice: choice.tried and choice.tried.interval),
            ResultField("", of=lambda choice: choice.tried and _share(choice.tried), title="yield [%]"),
            ResultField(
                "front",
                of=lambda c: c in self.front,
                title="front",
                text=lambda is_front: "●" if is_front else "",
            ),
        )

    def summary(self) -> RenderableType:
        table = self._fields.table("Cost and accuracy", self.choices)
        held = [f"{name}: {choice.held}" for name, choice in self.methods.items()]
        return Group(table, Text("\n".join([*held, FRONT_TEXT, *self.missing])))

    @property
    def methods(self) -> dict[str, Choice]:
        """One choice of each way to make plates, the least work first."""
        return {choice.method: choice for choice in reversed(self.choices)}

    def plot(self, name: str = "") -> "Figure":
        from workbench.report.figures import COLOURS, grid, look, new_figure, on_white

        with look():
            figure = new_figure(8.0, 4.4)
            axes = figure.subplots()
            for colour, method in zip(COLOURS, self.methods, strict=False):
                mine = [choice for choice in self.choices if choice.method == method]
                axes.plot(*_places(mine), "o", ms=11.0, color=colour, label=method)
            for number, (x, y) in enumerate(_places(self.choices).T, start=1):
                axes.text(x, y, str(number), color="white", fontsize=7, ha="center", va="center")
            axes.set_ylim(0.0, None)
            axes.set_xlabel("targets")
            axes.set_ylabel("predicted position error, rms [mm]")
            axes.legend(loc="upper right")
            grid(axes, "both")
        return on_white(figure)

    def json(self) -> Json:
        return document("workbench.plate-tradeoff/1", choices=self._fields.each(self.choices))


def _places(choices: Sequence[Choice]) -> np.ndarray:
    return np.array([(len(choice.design.plate), 1e3 * choice.design.cost) for choice in choices]).T


def weigh_choices(
    robot: Robot,
    plate: Plate,
    *,
    numbers: Sequence[int] = (8, 12, 16),
    methods: Sequence[str] = tuple(METHODS),
    places: int = 500,
    arms: int = 0,
    wanted: Wanted | None = None,
    seed: Seed = 0,
) -> Tradeoff:
    """Plates of several sizes, made in several ways, machined ones also of few shapes.

    Args:
        robot: Nominal arm with limits.
        plate: Where the plates lie, and the region.
        numbers: Of targets.
        manners: Ways to make them, by name.
        places: Random blocks from which each search begins.
        arms: Virtual arms on which each plate is tried; 0 for none.
        wanted: What every pose of them has to keep; ARIA eq. (3) if None.
        seed: Of everything random.
    """
    if unknown := [name for name in methods if name not in METHODS]:
        raise OptionError(
            f"unknown manufacturing method '{unknown[0]}'; known: {', '.join(METHODS)}",
            option="methods",
            found=unknown[0],
        )
    tried = [
        (name, number, shapes)
        for name in methods
        for number in numbers
        for shapes in ((None, FEW_SHAPES) if METHODS[name].reading == "seat" else (None,))
    ]
    choices: list[Choice] = []
    missing: list[str] = []
    for done, (name, number, shapes) in enumerate(tried):
        try:
            with part_of(done / len(tried), 1.0 / len(tried), "searching plates"):
                choice = _choice(
                    robot, plate, name, DesignRequest(number=number, shapes=shapes, places=places), seed
                )
        except DataError as error:  # the others are still of use
            few = "" if shapes is None else f", {shapes} shapes"
            missing.append(f"{name}, {number} targets{few}: not found; {error}")
            continue
        if arms:
            with part_of((done + 1) / len(tried), 0.0, "trying plates"):
                found = try_plate(
                    robot, choice.design.plate, arms=arms, wanted=wanted, towards=plate, seed=seed
                )
            choice = replace(choice, tried=found)
        if cancelled():  # this plate was cut short
            break
        choices.append(choice)
    if not choices:
        check_cancelled()
    if missing and not choices:
        raise DataError(missing[0])
    return Tradeoff(choices=tuple(sorted(choices, key=lambda c: c.work)), missing=tuple(missing))


def _choice(robot: Robot, plate: Plate, name: str, request: DesignRequest, seed: int) -> Choice:
    method = METHODS[name]
    requested, given = (
        replace(request, blocks=method.blocks(Blocks())),
        replace(plate, production=method.production),
    )
    design = optimise_plate(robot, given, request=requested, reading=method.reading, seed=seed)
    return Choice(method=name, design=design)


def _share(tried: Yield) -> str:
    """The yield and its 95 % interval [%]."""
    low, high = tried.interval
    return f"{100 * tried.share:.0f} ({100 * low:.0f}–{100 * high:.0f})"

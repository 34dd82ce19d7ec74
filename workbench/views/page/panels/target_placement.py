"""Arranging targets: another number, snapping, patterns, the whole table typed or pasted."""

from functools import partial

import numpy as np
import viser

from workbench.base.errors import OptionError
from workbench.plate.patterns import MOST_TARGETS, PATTERNS
from workbench.plate.plate import Plate
from workbench.session.commands.edit import MixBranches, RenumberTarget
from workbench.session.commands.plate import ClusterTargets, ImprovePlate
from workbench.session.commands.target_placement import ApplyPattern, PlaceTargets, SnapTarget
from workbench.session.state import Session, Units
from workbench.views.page.panels.coordinates import NAMES, SIZES, Quantity
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel, set_value

KINDS = {name.capitalize(): name for name in PATTERNS}
SEPARATORS = str.maketrans({",": " ", ";": " ", "\t": " ", "−": "-"})


class ImprovePanel(AbstractPanel):
    """The one button that makes the plate better."""

    depends = ("is_idle",)

    def build(self, gui: viser.GuiApi) -> None:
        self._improve = self.button(
            ImprovePlate.title,
            lambda: ImprovePlate(seed=len(self._worker.session.history)),
            viser.Icon.SPARKLES,
            "Let the program place all targets but the locked ones for the least predicted error in the "
            "region, reachable and free of collisions. Cancel stops it, Undo restores the old plate.",
            main=True,
        )

    def show(self, session: Session) -> None:
        self._improve.disabled = session.job is not None


class ArrangePanel(AbstractPanel):
    """Other commands that move several targets at once or place one precisely; folded."""

    depends = ("selected", "is_idle", lambda session: len(session.plate))

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Other searches", expand_by_default=False):
            self._build_searches(gui)
        with gui.add_folder("Snap and number", expand_by_default=False):
            self._build_snap(gui)
        with gui.add_folder("Pattern", expand_by_default=False):
            self._build_pattern(gui)

    def show(self, session: Session) -> None:
        set_value(self._number, session.selected + 1)
        self._cluster.disabled = session.job is not None
        self._number.max = len(session.plate)

    def _build_searches(self, gui: viser.GuiApi) -> None:
        self.button(
            "Best mix of branches",
            MixBranches,
            viser.Icon.ARROWS_SHUFFLE,
            "Choose the branches together for the least predicted error; branches chosen by hand are kept.",
        )
        self._cluster = self.button(
            "Search poses of equal index",
            self._search,
            viser.Icon.SEARCH,
            "Workspace clustering: replace the targets by as many poses with equal index O in mutually "
            "different cubes of the region, the best such set. Takes a few seconds; Undo reverts this.",
        )

    def _build_snap(self, gui: viser.GuiApi) -> None:
        self.sends_one_of(
            gui.add_button_group(
                "Snap to",
                ("Plate", "Grid", "Cube"),
                hint="Put the selected target 50 mm above the plate, on the 10 mm grid, or at the centre of "
                "the nearest cube of the region.",
            ),
            {
                name: partial(lambda to: SnapTarget(self._worker.session.selected, to), name.lower())
                for name in ("Plate", "Grid", "Cube")
            },
        )
        self._number = self.number(
            "Number", 1, (1, MOST_TARGETS, 1), "Position of the selected target in the measuring order."
        )
        self.sends(
            self._number, lambda: RenumberTarget(self._worker.session.selected, int(self._number.value) - 1)
        )

    def _build_pattern(self, gui: viser.GuiApi) -> None:
        self._pattern = gui.add_dropdown(
            "Pattern", list(KINDS), hint="Layout of the targets. The circle is the paper's Table 2."
        )
        self._count = self.number("Targets", 10, (1, MOST_TARGETS, 1), "Number of targets.")
        self._centre = gui.add_vector3(
            "Centre [mm]", (316.0, 354.0, 235.0), step=1.0, hint="Centre of the pattern in the base frame."
        )
        self._radius = self.number("Half width [mm]", 250.0, (1.0, 5000.0, 1.0), "Radius, or half the side.")
        self._tilts = gui.add_vector2(
            "Tilts [°]", (-150.0, -160.0), step=1.0, hint="Roll angles, assigned to the targets in turn."
        )
        self.button(
            "Apply the pattern",
            self._lay_out,
            viser.Icon.GRID_DOTS,
            "Replace all unlocked targets by this pattern; Undo reverts this.",
            main=True,
        )

    def _search(self) -> ClusterTargets:
        session = self._worker.session
        return ClusterTargets(len(session.plate), seed=len(session.history))

    def _lay_out(self) -> ApplyPattern:
        x, y, z = (1e-3 * float(v) for v in self._centre.value)
        tilts = tuple(float(np.deg2rad(v)) for v in self._tilts.value)
        radius = 1e-3 * float(self._radius.value)
        name = KINDS[self._pattern.value]
        return ApplyPattern(name, int(self._count.value), (x, y, z), radius, tilts)


class TablePanel(AbstractPanel):
    """The coordinates of all targets, to be typed or pasted."""

    pause = AFTERWARDS
    keeps_typed = True
    depends = ("plate", "units")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Coordinates of all targets", expand_by_default=False):
            self._table = gui.add_text(
                "x y z [mm] r p y [°]",
                "",
                multiline=True,
                hint="One line per target: x y z, then roll, pitch, yaw. Type, or paste from a spreadsheet; "
                "extra lines add targets.",
            )
            self.button(
                "Apply the coordinates",
                self._apply,
                viser.Icon.CHECK,
                "Move the targets to these coordinates; Undo reverts this.",
            )

    def show(self, session: Session) -> None:
        length, angle = (NAMES[session.units, quantity] for quantity in Quantity)
        self._table.label = f"x y z [{length}] r p y [{angle}]"
        set_value(self._table, table_of(session.plate, session.units))

    def _apply(self) -> PlaceTargets:
        session = self._worker.session
        return PlaceTargets(rows_of(self._table.value, session.plate, session.units))


def table_of(plate: Plate, units: Units = Units.MILLIMETRES) -> str:
    """The targets as lines of text."""
    length, angle = _sizes(units)
    rows = np.column_stack([plate.poses[:, :3, 3] / length, np.array([t.rpy for t in plate.targets]) / angle])
    return "\n".join("  ".join(_short(v) for v in row) for row in rows)


def rows_of(words: str, plate: Plate, units: Units = Units.MILLIMETRES) -> tuple[tuple[float, ...], ...]:
    """The numbers of a typed table in m and rad; lines that were not touched keep all their digits.

    Raises:
        OptionError: a line that is not six numbers; says which.
    """
    shown, (length, angle) = table_of(plate, units).splitlines(), _sizes(units)
    rows = []
    for i, line in enumerate(line for line in words.splitlines() if line.strip()):
        if i < len(shown) and line.split() == shown[i].split():
            target = plate.targets[i]
            rows.append((*target.xyz.tolist(), *target.rpy.tolist()))
            continue
        try:
            numbers = [float(word) for word in line.translate(SEPARATORS).split()]
        except ValueError:
            raise OptionError(f"line {i + 1} of the table, '{line[:40]}', is not all numbers") from None
        if len(numbers) != 6:
            raise OptionError(f"line {i + 1} of the table has {len(numbers)} numbers; give x y z r p y")
        place, turn = length * np.array(numbers[:3]), angle * np.array(numbers[3:])
        rows.append((*place.tolist(), *turn.tolist()))
    return tuple(rows)


def _sizes(units: Units) -> tuple[float, float]:
    """The units of length and angle in SI."""
    return SIZES[NAMES[units, Quantity.LENGTH]], SIZES[NAMES[units, Quantity.ANGLE]]


def _short(value: float) -> str:
    return f"{round(value, 5) + 0.0:.7g}" if abs(value) < 1e5 else f"{value:.1f}"

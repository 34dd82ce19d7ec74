"""Designing a plate, as one call."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.base.arguments import Count, Like, Seed, Sigma, checked_arguments
from workbench.base.errors import DataError, WorkbenchError
from workbench.base.progress import part_of
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.data.arguments import RobotLike
from workbench.plate.arguments import PlateLike
from workbench.plate.collision import table_height
from workbench.plate.free_constants import identified_names
from workbench.plate.optimiser import optimise
from workbench.plate.optimiser.candidates import Setting
from workbench.plate.optimiser.constraints import OWN_BLOCK, Constraints
from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import Blocks
from workbench.plate.plate import Kind, Plate
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.target_readings import sigma_of, usual_kind
from workbench.plate.tolerances import PIN_PLAY, Production

NARROW = Constraints(clearance=0.005, spacing=0.06, retreat=0.025)
"""Margins for an arm that has no room for the usual ones."""
TRIAL_BLOCKS, TRIAL_TARGETS_SHARE, TRIALS_SHARE = 150, 0.7, 0.7
"""Random blocks, and share of the targets, of a search that tells places apart; what of the time all take."""
MIN_HEIGHT_ABOVE_TABLE = 0.06
"""No plate is moved down so far that its top is less above the table [m]."""
SHIFTS = ((-0.1, 0.0), (0.1, 0.0), (0.0, -0.1), (0.0, 0.1), (-0.1, -0.1), (-0.1, 0.1))
"""Where else it is tried: farther from the base's axis and higher, as shares of the arm's reach."""


@checked_arguments()
@one_thread()
def optimise_plate(
    robot: RobotLike,
    plate: PlateLike,
    *,
    kind: Kind | None = None,
    sigma: Like[Sigma] | None = None,
    base: bool | None = None,
    tool: bool | None = None,
    number: int | None = None,
    blocks: Blocks | None = None,
    constraints: Constraints | None = None,
    production: Production | None = None,
    places: Count = optimise.POOL_BLOCKS,
    starts: Count = optimise.STARTS,
    moves: bool = False,
    seed: Seed = 0,
) -> PlateDesign:
    """The plate with the smallest predicted error in its region.

    Args:
        robot: Nominal arm with limits.
        plate: Where the plate lies, how large it is, its region; its targets are one of the starts.
        kind: What a target constrains; as the given plate's targets do if None.
        sigma: Standard deviations of the instrument, position [m] and rotation [rad]; typical ones of what is
            read at the targets if None.
        base: Whether the base is identified too; as the robot says if None.
        tool: Whether the tool is.
        number: How many targets; as many as the given plate has if None.
        blocks: Blocks that may be chosen from; usual ones if None.
        constraints: Margins that every target keeps; if None the usual ones, or narrower margins (with a
            note) where those leave no plate.
        production: Tolerances of production; as the given plate says if None.
        places: Random blocks from which targets are chosen.
        starts: Exchanges from different starts.
        moves: Whether the whole plate may be moved, nearer or farther and lower or higher, where quick
            searches find a better place; locked targets keep it where it is.
        seed: Of everything random.

    Raises:
        OptionError: a plate without size or inside the robot's base, more targets than fit.
        DataError: a region out of reach, or constraints that no target keeps; names those most often missed.
    """
    kind = kind or usual_kind(plate)
    play = plate.production.play if any(plate.production.play) else PIN_PLAY  # that of the drawn pins
    made = replace(plate.production, play=play if kind is Kind.SEAT else (0.0, 0.0))
    goal, plate = plate_region_poses(robot, plate), replace(plate, production=production or made)
    number = len(plate) if number is None else number
    names, sigma = identified_names(robot, base=base, tool=tool), sigma_of(kind, sigma)
    setting = partial(Setting, robot=robot, kind=kind, blocks=blocks or Blocks(), sigma=sigma, names=names)

    def search(plate: Plate, margins: Constraints, **changed: int) -> PlateDesign:
        how = {"number": number, "places": places, "starts": starts, **changed}
        rng = np.random.default_rng(seed)
        return optimise.optimise(setting(plate=plate, constraints=margins), goal=goal, rng=rng, **how)

    def best_place(margins: Constraints) -> Plate:
        """Where a quick search finds the smallest error; what it says where none finds any plate."""
        if len(everywhere) == 1:
            return plate
        found, wrong, share = {}, None, TRIALS_SHARE / len(everywhere)
        few = int(np.ceil(TRIAL_TARGETS_SHARE * number))
        for i, moved in enumerate(everywhere):
            try:
                with part_of(share * i, share, "trying places of the plate"):
                    quick = search(moved, margins, places=min(places, TRIAL_BLOCKS), starts=1, number=few)
                    found[i] = quick.cost
            except WorkbenchError as error:
                wrong = wrong or error
        if wrong is not None and not found:
            raise wrong
        return everywhere[min(found, key=found.__getitem__)]

    is_movable = moves and not any(target.locked for target in plate.targets)
    everywhere = (plate, *_moved(robot, plate)) if is_movable else (plate,)
    margins, begun = constraints or Constraints(floor=table_height(robot)), TRIALS_SHARE * is_movable
    try:
        place = best_place(margins)
        with part_of(begun, 1.0 - begun):
            return search(place, margins)
    except DataError as error:
        if constraints is not None:
            raise
        margins = replace(NARROW, floor=table_height(robot))
        with suppress(DataError):  # nor does any place of few blocks; many may have some
            plate = best_place(margins)
        design = search(plate, margins)
        kept = "5 mm clear, targets 60 mm apart, 25 mm of retreat"
        probe = "; the flange touches the blocks: give the robot its probe as the tool"
        narrowed = kept + probe * (OWN_BLOCK in str(error))
        return replace(design, narrowed=narrowed, notes=(f"{error}; kept: {kept}", *design.notes))


def _moved(robot: Robot, plate: Plate) -> Iterator[Plate]:
    """The same plate in other places, its targets with it."""
    along = np.append(plate.xyz[:2], 0.0) / max(float(np.hypot(*plate.xyz[:2])), 1e-9)
    for out, up in SHIFTS:
        move = robot.reach * (out * along + np.array([0.0, 0.0, up]))
        targets = tuple(replace(target, xyz=frozen(target.xyz + move)) for target in plate.targets)
        if up >= 0.0 or plate.xyz[2] + move[2] + height_above_floor(robot) >= MIN_HEIGHT_ABOVE_TABLE:
            yield replace(plate, xyz=frozen(plate.xyz + move), targets=targets)

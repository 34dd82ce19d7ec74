"""Designing a plate, as one call."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Unpack

import numpy as np

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.base.arguments import LengthAndOptionalAngle, Like, Seed, checked_arguments, with_fields
from workbench.base.errors import DataError, WorkbenchError
from workbench.base.progress import part_of
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.data.arguments import RobotLike
from workbench.plate.arguments import PlateLike
from workbench.plate.collision import table_height
from workbench.plate.free_constants import identified_names
from workbench.plate.optimiser import optimise
from workbench.plate.optimiser.constraints import OWN_BLOCK, Constraints
from workbench.plate.optimiser.optimise import DesignRequest, RequestFields
from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import few_shapes, places_of
from workbench.plate.plate import Plate
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.target_readings import TargetReading, reading_named, usual_reading
from workbench.plate.tolerances import PIN_PLAY

NARROW = Constraints(clearance=0.005, spacing=0.06, retreat=0.025)
"""Margins for an arm that has no room for the usual ones."""
TRIAL_BLOCKS, TRIAL_TARGETS_SHARE = 150, 0.7
"""Random blocks, and share of the targets, of a search that tells places of the plate apart."""
MIN_HEIGHT_ABOVE_TABLE = 0.06
"""No plate is moved down so far that its top is less above the table [m]."""
SHIFTS = ((-0.1, 0.0), (0.1, 0.0), (0.0, -0.1), (0.0, 0.1), (-0.1, -0.1), (-0.1, 0.1))
"""Where else it is tried: farther from the base's axis and higher, as shares of the arm's reach."""


@checked_arguments(DesignRequest)
@one_thread()
def optimise_plate(
    robot: RobotLike,
    plate: PlateLike,
    *,
    request: DesignRequest | None = None,
    reading: str | TargetReading | None = None,
    sigma: Like[LengthAndOptionalAngle] | None = None,
    visits: int = 1,
    base: bool | None = None,
    tool: bool | None = None,
    moves: bool = False,
    seed: Seed = 0,
    **fields: Unpack[RequestFields],
) -> PlateDesign:
    """The plate with the smallest predicted error in its region.

    Args:
        robot: Nominal arm with limits.
        plate: Where the plate lies, how large it is, its region; its targets are one of the starts.
        request: What is asked of the plate; its fields may be given as keywords, such as `number=8`, where
            `request` does not set them. Where neither it nor `constraints` is given, narrower margins are
            tried (with a note) if the usual ones leave no plate.
        reading: What is read at a target: seat, socket, point, contacts or ball-bar; as the given plate's
            targets are if None.
        sigma: Standard deviations of one visit [m], [rad]; those of the reading if None.
        visits: How often each target is visited.
        base: Whether the base is identified too; as the robot says if None.
        tool: Whether the tool is.
        moves: Whether the whole plate may be moved, nearer or farther and lower or higher, where quick
            searches find a better place; locked targets keep it where it is.
        seed: Of everything random.

    Raises:
        OptionError: a plate without size or inside the robot's base, more targets than fit.
        DataError: a region out of reach, or constraints that conflict; names the two.
    """
    if not isinstance(reading, TargetReading):
        reading = reading_named(reading or usual_reading(plate), robot, plate, sigma=sigma, visits=visits)
    is_usual = request is None and "constraints" not in fields
    request = with_fields(DesignRequest, request, fields)
    made = plate.production
    if reading.name != "seat":
        made = replace(made, play=(0.0, 0.0))
    elif not any(made.play):  # seats of which the file tells no play have that of the drawn pins
        made = replace(made, play=PIN_PLAY)
    request = replace(request, production=request.production or made)

    def search(request: DesignRequest, plate: Plate = plate) -> PlateDesign:
        return optimise.optimise_plate(
            robot,
            plate,
            reading=reading,
            goal=goal,
            rng=np.random.default_rng(seed),
            request=request,
            names=names,
        )

    goal, names = plate_region_poses(robot, plate), identified_names(robot, base=base, tool=tool)
    is_movable = moves and plate.anchors is None and not any(target.locked for target in plate.targets)
    places = (plate, *_moved(robot, plate)) if is_movable else (plate,)
    if not is_usual:
        return _of_few_shapes(partial(search, plate=_best_place(search, places, request)), request)
    request = replace(request, constraints=Constraints(floor=table_height(robot)))
    try:
        return _of_few_shapes(partial(search, plate=_best_place(search, places, request)), request)
    except DataError as error:
        request = replace(request, constraints=replace(NARROW, floor=table_height(robot)))
        with suppress(DataError):  # nor does any place of few blocks; many may have some
            plate = _best_place(search, places, request)
        design = _of_few_shapes(partial(search, plate=plate), request)
        kept = "5 mm clear, targets 60 mm apart, 25 mm of retreat"
        probe = "; the flange touches the blocks: give the robot its probe as the tool"
        narrowed = f"{kept}{probe if OWN_BLOCK in str(error) else ''}"
        return replace(design, narrowed=narrowed, notes=(f"{error}; kept: {kept}", *design.notes))


def _moved(robot: Robot, plate: Plate) -> Iterator[Plate]:
    """The same plate in other places, its targets with it."""
    along = np.append(plate.xyz[:2], 0.0) / max(float(np.hypot(*plate.xyz[:2])), 1e-9)
    for out, up in SHIFTS:
        move = robot.reach * (out * along + np.array([0.0, 0.0, up]))
        targets = tuple(replace(target, xyz=frozen(target.xyz + move)) for target in plate.targets)
        if up >= 0.0 or plate.xyz[2] + move[2] + height_above_floor(robot) >= MIN_HEIGHT_ABOVE_TABLE:
            yield replace(plate, xyz=frozen(plate.xyz + move), targets=targets)


def _best_place(
    search: Callable[[DesignRequest, Plate], PlateDesign], places: Sequence[Plate], request: DesignRequest
) -> Plate:
    """The plate where a quick search finds the smallest error; what it says where none finds any plate."""
    if len(places) == 1:
        return places[0]
    found, wrong = {}, None
    number = int(np.ceil(TRIAL_TARGETS_SHARE * (request.number or len(places[0]))))
    quick = replace(request, places=min(request.places, TRIAL_BLOCKS), starts=1, number=number)
    for i, plate in enumerate(places):
        try:
            with part_of(0.0, 0.0, "trying places of the plate"):
                found[i] = search(quick, plate).cost
        except WorkbenchError as error:
            wrong = wrong or error
    if wrong is not None and not found:
        raise wrong
    return places[min(found, key=found.__getitem__)]


def _of_few_shapes(search: Callable[[DesignRequest], PlateDesign], request: DesignRequest) -> PlateDesign:
    """The best plate, of no more different blocks than asked for.

    The shapes are those from which the other ones are least unlike: of the free optimum, then of the best
    plate with twice as many.
    """

    def limited(free: PlateDesign, number: int) -> PlateDesign:
        shapes = few_shapes(places_of(free.plate, free.plate.poses), number)
        return search(replace(request, blocks=replace(request.blocks, shapes=shapes)))

    free, number = search(request), request.shapes
    if number is None or free.plate_shapes <= number:
        return free
    few, twice = limited(free, number), limited(free, 2 * number)
    other = twice if twice.plate_shapes <= number else limited(twice, number)
    return min(few, other, key=lambda design: design.cost)

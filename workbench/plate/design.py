"""Designing a plate, clustering poses, and trying a plate on virtual arms, as one call each."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.linearisation import linearise
from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.progress import part_of
from workbench.base.threads import one_thread
from workbench.data.accuracy_requirement import Requirement, Wanted
from workbench.plate import clustering
from workbench.plate.clustering import Clustering
from workbench.plate.criterion import goal_index
from workbench.plate.door import door
from workbench.plate.free_constants import identified_names
from workbench.plate.monte_carlo.production_yield import ARMS, Yield, check_number, try_production
from workbench.plate.monte_carlo.yield_inputs import ErrorSizes, YieldJob, constrained_by
from workbench.plate.optimiser import optimise
from workbench.plate.optimiser.constraints import Constraints
from workbench.plate.optimiser.optimise import DesignRequest
from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.optimiser.target_blocks import few_shapes, places_of
from workbench.plate.parts.stock import Stock
from workbench.plate.plate import ANCHOR_SIGMA, Plate
from workbench.plate.poses.sampling import in_base
from workbench.plate.readings import TargetReading, assumptions, reading_named, usual_reading, usual_sigma
from workbench.plate.region import Region
from workbench.plate.region_poses import PLATE_CONE, PLATE_POSES, plate_region_poses, region_poses
from workbench.plate.target_branches import choose_branches, measurable
from workbench.plate.tolerances import Making

LENGTH_ERROR, ANGLE_ERROR = 5e-3, float(np.deg2rad(5.0))
"""Largest manufacturing errors of a length [m] and an angle [rad] in a production run, as in ARIA §2.4."""
ERROR = "I"
"""Name of the index that is the predicted error over the region."""
JUDGED_POSES = 500
"""Poses of the tool in the region, in all their branches, at which arms are judged."""
NARROW = Constraints(clearance=0.005, spacing=0.06, retreat=0.025)
"""Margins for an arm that has no room for the usual ones."""
DOWN = np.diag([1.0, -1.0, -1.0])
"""Orientation of a tool that points straight down."""


@door()
@one_thread()
def optimise_plate(
    robot: Robot,
    plate: Plate,
    *,
    request: DesignRequest | None = None,
    making: Making | None = None,
    reading: str | TargetReading | None = None,
    sigma: tuple[float, float | None] | None = None,
    visits: int = 1,
    base: bool | None = None,
    tool: bool | None = None,
    seed: int = 0,
) -> PlateDesign:
    """The plate with the least predicted error in its region.

    Args:
        robot: Nominal arm with limits.
        plate: Where the plate lies, how large it is, its region; its targets are one of the starts.
        request: Number of targets, branches, blocks, constraints, tolerances; the usual ones if None, with
            narrower margins (and a note) where the usual margins leave no plate.
        making: Tolerances of the making where the request has none; as `plate_making` says if None.
        reading: What is read at a target: seat, socket, point, contacts or ball-bar; as the given plate's
            targets are if None.
        sigma: Standard deviations of one visit [m], [rad]; those of the reading if None.
        visits: How often each target is visited.
        base: Whether the base is identified too; as the robot says if None.
        tool: Whether the tool is.
        seed: Of everything random.

    Raises:
        OptionError: a plate without size or inside the robot's base, more targets than fit.
        DataError: a region out of reach, or constraints that conflict; names the two.
    """
    if not isinstance(reading, TargetReading):
        reading = reading_named(reading or usual_reading(plate), robot, plate, sigma=sigma, visits=visits)
    making = making or plate_making(plate, reading.name)

    def search(request: DesignRequest) -> PlateDesign:
        return optimise.optimise_plate(
            robot,
            plate,
            reading=reading,
            goal=goal,
            rng=np.random.default_rng(seed),
            request=replace(request, making=request.making or making),
            names=names,
        )

    goal, names = goal_poses(robot, plate), identified_names(robot, base=base, tool=tool)
    if request is not None:
        return _priced(search, request)
    try:
        return search(DesignRequest())
    except DataError as error:
        design = search(DesignRequest(constraints=NARROW))
        return replace(
            design, notes=(f"{error}; kept: 5 mm clear, targets 60 mm apart, 25 mm of retreat", *design.notes)
        )


def plate_making(plate: Plate, reading: str) -> Making:
    """How a plate that is designed is made: as its file says; seats of which it tells no play have that of
    the drawn pins."""
    if reading != "seat":
        return replace(plate.making, play=(0.0, 0.0))
    return plate.making if any(plate.making.play) else replace(plate.making, play=Stock().play)


def _priced(search: Callable[[DesignRequest], PlateDesign], request: DesignRequest) -> PlateDesign:
    """The best plate, with what few tilts and few shapes of its blocks cost against those at will.

    Blocks that are bought, at the heights and on the grid that there are, have no others to compare with.
    """
    found, blocks, words = search(request), request.blocks, []
    if blocks.tilts and not blocks.levels:
        free = search(replace(request, blocks=replace(blocks, tilts=())))
        tilts = ", ".join(f"{np.rad2deg(tilt):g}°" for tilt in blocks.tilts)
        words.append(_price(f"blocks of {tilts} alone", found, free, "any tilt"))
    if request.shapes is not None and found.plate_shapes > request.shapes:
        few = _few_shapes(search, request, found)
        different = f"{found.plate_shapes} different ones"
        words.insert(0, _price(f"{request.shapes} shapes of block", few, found, different))
        found = few
    return replace(found, notes=(*words, *found.notes))


def _price(what: str, found: PlateDesign, free: PlateDesign, others: str) -> str:
    """The accuracy cost of a restriction, in words."""
    extra = found.cost - free.cost
    price = f"{1e3 * extra:.3f} mm ({100 * extra / free.cost:.0f} %)" if extra >= 5e-7 else "no accuracy"
    return f"{what} cost {price}: {1e3 * found.cost:.3f} mm instead of {1e3 * free.cost:.3f} mm with {others}"


def _few_shapes(
    search: Callable[[DesignRequest], PlateDesign], request: DesignRequest, free: PlateDesign
) -> PlateDesign:
    """The best plate of few different blocks.

    The shapes are those from which the other ones are least unlike: of the free optimum, then of the best
    plate with twice as many.
    """
    assert request.shapes is not None
    source, best = free, free
    for more in (True, False):
        if source.plate_shapes <= request.shapes:
            break
        places = places_of(source.plate, source.plate.poses)
        few, twice = (
            replace(request, blocks=replace(request.blocks, shapes=few_shapes(places, number)))
            for number in (request.shapes, 2 * request.shapes)
        )
        found = search(few)
        best = found if best is free or found.cost < best.cost else best
        source = search(twice) if more else source
    return best


def goal_poses(robot: Robot, plate: Plate) -> np.ndarray:
    """Joint positions of poses that matter: turned from the targets by up to 60°, or from straight down."""
    if len(plate):
        return plate_region_poses(robot, plate)
    rng, down = np.random.default_rng(0), (plate.pose[:3, :3] @ DOWN)[None]
    return region_poses(robot, plate.region, PLATE_POSES, rng=rng, towards=down, cone=PLATE_CONE)


@door()
@one_thread()
def try_plate(
    robot: Robot,
    plate: Plate,
    *,
    arms: int = ARMS,
    sigma: tuple[float, float] | None = None,
    joint_sigma: float = 0.0,
    making: Making | None = None,
    undeclared: tuple[AbstractEffect, ...] = (),
    length: float = LENGTH_ERROR,
    angle: float = ANGLE_ERROR,
    wanted: Wanted | None = None,
    towards: Plate | None = None,
    poses: int = JUDGED_POSES,
    scheduler: str | None = None,
    seed: int = 0,
) -> Yield:
    """How many arms of a production run meet the requirement after a calibration with a plate.

    Args:
        robot: Nominal arm with limits.
        plate: Targets and region; targets without joint positions take the branches that tell most.
        arms: How many virtual arms.
        sigma: How well a target returns and is read: standard deviations [m], [rad]; usual ones of what is
            read at the targets if None.
        joint_sigma: Of the joint readings [rad or m].
        making: Tolerances of the making; as the plate says if None. Targets that say how well they are known
            keep that.
        undeclared: Effects that every actual arm has and the calibration does not know.
        length: Greatest manufacturing error of a length [m].
        angle: Greatest manufacturing error of an angle [rad].
        wanted: What every pose has to keep; ARIA eq. (3) if None.
        towards: Plate about whose targets' orientations the poses of the region are turned by up to 60°, so
            that plates compare; this one if None.
        poses: Poses of the tool in the region, in all their branches, at which arms are judged.
        scheduler: Address of a Dask scheduler; this machine's cores if None.
        seed: Of everything random.
    """
    check_number(arms)
    plate = plate if making is None else replace(plate, making=making)
    sigma = sigma or usual_sigma(plate)
    q = planned_joints(robot, plate, sigma)
    asked = plate if towards is None else replace(towards, region=plate.region)
    bank = plate_region_poses(robot, asked, poses)
    errors = ErrorSizes(
        seat_position=sigma[0],
        seat_rotation=sigma[1],
        joint=joint_sigma,
        target_position=plate.known[:, 0],
        target_rotation=plate.known[:, 1],
        play=plate.play,
        away=None if plate.anchors is None else plate.from_anchors @ robot.base.pose[:3, :3].T,
        anchor=0.0 if plate.anchors is None else ANCHOR_SIGMA,
        undeclared=replace(robot, effects=undeclared) if undeclared else None,
    )
    job = YieldJob(
        robot=replace(robot, effects=()),
        names=robot.default_free,
        poses=robot.base.pose @ plate.poses,
        q=q,
        constrained=constrained_by(plate),
        errors=errors,
        sigma=errors.assumed,
        length=length,
        angle=angle,
        bank=bank,
        cells=plate.region.cells(in_base(robot, bank)[:, :3, 3]),
        wanted=wanted or Requirement().wanted,
    )
    found = try_production(job, arms=arms, seed=seed, scheduler=scheduler)
    held = [assumptions(plate, sigma)]
    if joint_sigma:
        held.append(f"joint readings {np.rad2deg(joint_sigma):.2g}°")
    held += [f"undeclared {effect.phrase}" for effect in undeclared]
    return replace(found, assumptions="; ".join(held))


def planned_joints(robot: Robot, plate: Plate, sigma: tuple[float, float]) -> np.ndarray:
    """Joint positions at which each target is to be measured: the plate's own, or the mix that tells most."""
    own = [target.q for target in plate.targets if target.q is not None]
    if own and len(own) == len(plate):
        return np.stack(own)
    can = measurable(robot, plate)
    if can.lacking:
        number, why = next(iter(can.lacking.items()))
        raise DataError(f"target {number + 1} is {why}; move it, then try the plate")
    rng = np.random.default_rng(0)
    goal = plate_region_poses(robot, plate)
    with part_of(0.0, 0.0):
        return choose_branches(robot, plate, can.solutions, goal=goal, rng=rng, sigma=sigma).q


@one_thread()
def cluster_region(
    robot: Robot,
    region: Region,
    *,
    number: int = 10,
    side: float | None = None,
    index: str = ERROR,
    towards: Float[np.ndarray, "orientations 3 3"] | None = None,
    cone: float = np.pi,
    solid: Plate | None = None,
    seed: int = 0,
) -> Clustering:
    """Poses with equal O in different cubes of a region, the best such set (ARIA 4.2).

    Args:
        robot: Nominal arm.
        region: The cuboid.
        number: How many poses.
        side: Side L of the cubes [m]; the region's own if None.
        index: What is made large among sets with equal O: `O1` … `O5`, `A`, `D`, or `I`.
        towards: Orientations of the tool about which a cone opens; any orientation if None.
        cone: Greatest angle from the nearest of them [rad].
        solid: A plate that the arm must not run into, as long as there are such poses; none if None.
        seed: Of the random candidates.
    """
    goal: str | np.ndarray = index
    if index == ERROR:
        goal = region_poses(
            robot, region, PLATE_POSES, rng=np.random.default_rng(0), towards=towards, cone=cone
        )
    middle = robot.search_limits.mean(axis=1)[None]

    def search(solid: Plate | None) -> Clustering:
        return clustering.cluster_region(
            robot,
            region if side is None else replace(region, cube=side),
            index=goal_index(goal, robot, linearise(robot, middle)),
            rng=np.random.default_rng(seed),
            number=number,
            limits=replace(clustering.ROOMY, towards=towards, cone=cone, solid=solid),
        )

    if solid is None or solid.size is None:
        return search(None)
    try:
        return search(solid)
    except DataError:  # too few poses are clear of it: the others are better than none, and are named
        return search(None)

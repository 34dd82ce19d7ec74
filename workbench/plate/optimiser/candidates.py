"""Candidates: targets, each in one branch, that keep every constraint on their own, with the rows they
measure.

They come from many random blocks on a plate, in every branch that reaches them. Two candidates may still
conflict: the arm at one touches the block of the other. This is checked only for pairs that a search
considers, and cached.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.branch import margins
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.follow import follow_many
from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.linearisation import linearise
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.progress import check_cancelled, progress
from workbench.base.types import Poses
from workbench.plate.optimiser.constraints import OWN_BLOCK, Constraints
from workbench.plate.optimiser.meshes import arm_shape
from workbench.plate.optimiser.shapes import ArmShape, Collider, Placements, block_hulls, plate_hull
from workbench.plate.optimiser.target_blocks import APART, Blocks, Places, places_of, tool_poses_at
from workbench.plate.plate import Kind, Plate
from workbench.plate.reach_margin import with_reach_margin

RETREATS = np.array([0.5, 1.0])
"""Positions along the probe's retreat that are checked, as shares of it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Candidates:
    """Targets, each in one posture of the arm.

    Args:
        places: Their blocks.
        poses: Of the tool in the robot's base.
        q: Joint positions [rad or m].
        branches: Names of the inverse-kinematics branches.
        placements: Of the arm at the target and during the retreat.
        rows: Whitened rows per scaled parameter.
        own: Slot of the locked target that each is of, the first slots being theirs; −1 of all others.
    """

    places: Places
    poses: Float[np.ndarray, "rows 4 4"]
    q: Float[np.ndarray, "rows n"]
    branches: np.ndarray
    placements: Float[np.ndarray, "rows stops frames 4 4"]
    rows: Float[np.ndarray, "rows m p"]
    own: Int[np.ndarray, " rows"]

    def __len__(self) -> int:
        return len(self.q)

    def take(self, rows: Int[np.ndarray, " k"] | Bool[np.ndarray, " rows"]) -> "Candidates":
        return Candidates(**{name: value[rows] for name, value in vars(self).items()})

    @staticmethod
    def joined(*some: "Candidates") -> "Candidates":
        names = Candidates.__dataclass_fields__
        return Candidates(**{name: np.concatenate([getattr(one, name) for one in some]) for name in names})


@dataclass(frozen=True, eq=False, kw_only=True)
class Setting:
    """Everything about a fixture that its search does not change.

    Args:
        plate: Pose, size and production of the plate.
        kind: What its targets constrain.
        blocks: What blocks it may carry.
        sigma: Standard deviations of a reading [m], [rad].
        names: Constants to be identified.
    """

    robot: Robot
    plate: Plate
    kind: Kind
    blocks: Blocks
    constraints: Constraints
    sigma: tuple[float, float]
    names: tuple[str, ...]

    @cached_property
    def arm(self) -> ArmShape:
        """The arm's shape."""
        return arm_shape(self.robot, self.constraints.clearance)

    @cached_property
    def scales(self) -> Float[np.ndarray, " p"]:
        """One metre of each scaled parameter in its own unit."""
        return linearise(self.robot, np.zeros((1, self.robot.dof)), names=self.names).weights

    @cached_property
    def half(self) -> Float[np.ndarray, "2"]:
        """How far from the plate's centre targets may lie along its length and width [m]."""
        plate, edge = self.plate, self.constraints.edge
        if plate.size is None:
            raise OptionError(
                f"plate '{plate.name}' has no size to place targets on; give "
                "size = [length, width, thickness] in m"
            )
        half = 0.5 * plate.size[:2] - edge
        if (half < 0.0).any():
            raise OptionError(
                f"plate size and edge conflict: {1e3 * edge:.0f} mm from every edge leave no room on "
                f"{1e3 * plate.size[0]:.0f} × {1e3 * plate.size[1]:.0f} mm; make the plate larger"
            )
        return half

    @property
    def is_turned_by_the_arm(self) -> bool:
        """Whether a block takes the orientation that the tool has there: few joints can't take any other."""
        return self.robot.dof < int(Task.POSE) and self.kind is not Kind.SEAT

    @cached_property
    def solid(self) -> Collider | None:
        """The plate's, which stands still whatever the targets are."""
        size = self.plate.size
        return None if size is None else plate_hull(self.plate.pose, size)

    def around(self, placements: Placements, *, minimum: float = np.inf) -> Float[np.ndarray, "rows 3"]:
        """Distances of the arm from itself, the table and the plate [m]."""
        floor = self.constraints.floor
        return self.arm.clearances(placements, solid=self.solid, floor=floor, minimum=minimum)

    @property
    def spacing(self) -> float:
        """Minimum distance of two targets on the plate; blocks never overlap [m]."""
        return max(self.constraints.spacing, APART)

    def examine(
        self, places: Places, q: Float[np.ndarray, "rows n"], branches: np.ndarray
    ) -> tuple[Candidates, Int[np.ndarray, " kept"], Counter[str]]:
        """Targets that keep all constraints on their own, which of all these are, and how many others whose
        block can be made miss each constraint, the first one that they miss.

        Args:
            places: Blocks.
            q: A posture of the arm at each [rad or m].
            branches: Its name.
        """
        limits, clearance = self.constraints, self.constraints.clearance
        rows, missed = np.flatnonzero(self.blocks.fit(places, self.half)), Counter[str]()

        def keep(what: str, kept: Bool[np.ndarray, " rows"]) -> Bool[np.ndarray, " rows"]:
            nonlocal rows
            missed[what] += int((~kept).sum())
            rows = rows[kept]
            return kept

        keep("joint limits", margins(q[rows], self.robot.limits).min(1) >= limits.limit_margin)
        around = self.around(self.arm.placements(q[rows]), minimum=clearance)
        for column, what in enumerate(("of the arm from itself", "from the table", "from the plate")):
            around = around[keep(f"clearance {what}", around[:, column] >= clearance)]
        roomy = with_reach_margin(self.robot, q[rows], errors=limits.errors)
        keep("reach of arms with manufacturing errors", roomy)
        poses = tool_poses_at(self.plate, places)
        stops, free = self._retreats(poses[rows], q[rows])
        stops = stops[keep("retreat along the probe", free)]
        every = Candidates(
            places=places[rows],
            poses=poses[rows],
            q=q[rows],
            branches=branches[rows],
            placements=stops,
            rows=self.rows(q[rows], places[rows]),
            own=np.full(len(rows), -1),
        )
        near = Neighbours(self, every)
        clear = np.array([near.misses(i, i) for i in range(len(every))], bool)
        return every.take(keep(OWN_BLOCK, clear)), rows, missed

    def _retreats(
        self, poses: Poses, q: Float[np.ndarray, "rows n"]
    ) -> tuple[np.ndarray, Bool[np.ndarray, " rows"]]:
        """Where the arm is at the target and during its retreat, and whether this is possible and clear."""
        stops, free = [self.arm.placements(q)], np.ones(len(q), bool)
        clearance = self.constraints.clearance
        for share in RETREATS if self.constraints.retreat > 0.0 else []:
            back = self.robot.base.pose @ poses
            back[:, :3, 3] -= share * self.constraints.retreat * back[:, :3, 2]
            followed = follow_many(self.robot, back, q)
            stops.append(self.arm.placements(followed.q))
            around = self.around(stops[-1], minimum=clearance)
            free &= followed.converged & (around >= clearance).all(1)
        return np.stack(stops, axis=1), free

    def rows(self, q: Float[np.ndarray, "rows n"], places: Places) -> Float[np.ndarray, "rows m p"]:
        """Whitened rows per scaled parameter, for targets in postures."""
        twists = identification_jacobian(self.robot, Motion(q), self.names)[1]
        is_seat, made = self.kind is Kind.SEAT, self.plate.production
        known = np.hypot(made.sigma(places[:, 2]), made.play_sigma * is_seat)
        deviations = np.repeat(np.hypot(self.sigma, known), 3, axis=1)
        return (twists * self.scales / deviations[:, :, None])[:, : 6 if is_seat else 3]


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Which candidates of one setting can be on one plate together."""

    setting: Setting
    pool: Candidates
    _seen: dict[tuple[int, int], bool] = field(default_factory=dict)

    @cached_property
    def _hulls(self) -> list[Collider]:
        return block_hulls(self.setting.plate.pose, self.pool.poses)

    def options(self, slot: int, others: Iterable[int]) -> Bool[np.ndarray, " rows"]:
        """Candidates for a slot that are far enough from all others, those of its own target if locked."""
        xy, own = self.pool.places[:, :2], self.pool.own
        result = own == (slot if slot in own else -1)
        for other in others:
            result &= np.hypot(*(xy - xy[other]).T) >= self.setting.spacing
        return result

    def clear(self, one: int, others: Iterable[int]) -> bool:
        """Whether the arm at a candidate keeps clear of the others' blocks, and at the others of its own."""
        return all(self.misses(one, other) and self.misses(other, one) for other in others)

    def misses(self, visitor: int, block: int) -> bool:
        """Whether the arm at a candidate keeps clear of a block; its probe may touch its own."""
        if (visitor, block) not in self._seen:
            clearance = self.setting.constraints.clearance
            self._seen[visitor, block] = self.gap(visitor, block, minimum=clearance) >= clearance
        return self._seen[visitor, block]

    def gap(self, visitor: int, block: int, *, minimum: float = np.inf) -> float:
        """Distance of the arm at a candidate, and during its retreat, from the block of another [m]."""
        arm = self.setting.arm
        checked = ~arm.probes if visitor == block else np.ones(len(arm.bodies), bool)
        placements, hull = self.pool.placements[visitor], self._hulls[block]
        return float(arm.hull_distances(placements, [hull], checked=checked, minimum=minimum).min())


BLOCKS_PER_CHECK = 50
"""Number of blocks solved between two checks of `cancelled`."""
BlockSolutions = tuple[Int[np.ndarray, " rows"], Places, Float[np.ndarray, "rows n"], np.ndarray]
"""Of each posture: the number of its block, that block, joint positions [rad or m], and its branch's name."""


def draw_pool(setting: Setting, number: int, *, rng: np.random.Generator) -> tuple[Candidates, Counter[str]]:
    """Candidates from so many random blocks, and how many solutions missed each constraint."""
    found, missed, done = list[Candidates](), Counter[str](), 0
    while done < number:
        check_cancelled()
        places = setting.blocks.draw(min(BLOCKS_PER_CHECK, number - done), setting.half, rng=rng)
        good, _, lost = setting.examine(*solutions_at(setting, places)[1:])
        found.append(good)
        missed += lost
        done += len(places)
        progress(done / number, "drawing places for targets")
    return Candidates.joined(*found), missed


def solutions_at(setting: Setting, places: Places) -> BlockSolutions:
    """Every branch within the joint limits at every block; blocks for balls face an arm of few joints."""
    robot, base = setting.robot, setting.robot.base.pose
    task = Task.POSITION if setting.is_turned_by_the_arm else None
    results = inverse.solve_many(robot, base @ tool_poses_at(setting.plate, places), task=task)
    slots = [i for i, result in enumerate(results) for _ in result.within_limits]
    branches = [branch for result in results for branch in result.within_limits]
    q = np.array([branch.q for branch in branches]).reshape(-1, robot.dof)
    names = np.array([branch.name for branch in branches], dtype="U80")
    own = places[slots]
    if setting.is_turned_by_the_arm and len(q):
        own = places_of(setting.plate.pose, se3.inverse(base) @ tool_poses(robot, Motion(q)))
    return np.array(slots, np.int64), own, q, names


def given_solutions(setting: Setting, plate: Plate) -> BlockSolutions:
    """Solutions of the given plate's targets; for a target with joint positions only the nearest ones."""
    plate.check_joints(setting.robot)
    slots, places, q, names = solutions_at(setting, places_of(plate.pose, plate.poses))
    keep = np.ones(len(q), bool)
    for slot, target in enumerate(plate.targets):
        mine = np.flatnonzero(slots == slot)
        if target.q is not None and len(mine):
            turns = np.abs(np.angle(np.exp(1j * (q[mine] - target.q)))).max(1)
            keep[mine] = turns == turns.min()
    return slots[keep], places[keep], q[keep], names[keep]

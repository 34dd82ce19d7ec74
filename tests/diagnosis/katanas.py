"""Katana arms that tilt: clearance, play and compliance of Tables 4.3 and 4.4, measured as the thesis does.

Kinematics and laws are those of `generator.py` and `laws.py`, errors of the geometry as in Table 3.2; the 118
poses lie on the diagonal planes of the largest cube (ISO 9283). Joint 1 stands upright, where no weight turns
it: its play and compliance can't show, and it has none here.
"""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import generator
import numpy as np
from arms import robot_of
from generator import VirtualArm, rotation
from laws import Effect, State, deflected_links, poses
from studies.katana_printed import BACKLASH, CLEARANCE, STIFFNESS

from workbench import Dataset, Robot
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.plate.poses.iso_cube import iso_cube_poses

TILTING = (1, 2, 3, 4)
"""Joints 2 to 5, counted from 0."""
POSES = 118
SIGMA = 1e-5, 1.2e-4
"""Noise per axis [m, rad]: 0.01 mm, and what it turns a pose by if each of three markers on a circle of 60 mm
radius has it, the mean of the three axes (0.0069°)."""
ANGLE, LENGTH = float(np.deg2rad(0.12)), 1e-5
"""Greatest errors of the geometry [rad, m]."""
CENTRE = 2e-3
"""Standard deviation of the links' centres of mass along each axis [m]."""
COMPLIANCE = 1.0 / STIFFNESS
"""Reciprocals of Table 4.4 [rad/(N m)]; Table 4.3, each to one side, is `CLEARANCE` and `BACKLASH` [rad]."""


class Katana(NamedTuple):
    """The nominal arm as the program gets it, its measured poses, the arm as made, what tilts, drivers."""

    robot: Robot
    data: Dataset
    actual: VirtualArm
    hidden: tuple[Effect, ...]
    state: State

    @property
    def sizes(self) -> dict[str, float]:
        """Coefficients as the package names them, SI."""
        text = {"clearance-tilt": "clearance", "backlash": "backlash", "joint-compliance": "compliance"}
        return {f"joint{e.joints[0] + 1}.{text[e.name]}": e.size[0] for e in self.hidden}


def tilting(*, spread=0.0, rng=None):
    """Clearance, play and compliance of joints 2 to 5, each off its table by up to a share of it."""
    kinds = (
        ("clearance-tilt", CLEARANCE, None),
        ("backlash", BACKLASH, "moment"),
        ("joint-compliance", COMPLIANCE, None),
    )
    off = (lambda: 1.0 + spread * rng.uniform(-1, 1)) if spread else (lambda: 1.0)
    return tuple(
        Effect(name, (j,), (float(size[j] * off()),), detail) for name, size, detail in kinds for j in TILTING
    )


@cache
def nominal_robot():
    """The arm as the program gets it."""
    robot = robot_of(generator.katana(), "katana", False)
    return replace(robot, joints=tuple(replace(joint, com_tolerance=CENTRE) for joint in robot.joints))


def still(q, payload=0.0):
    """The state of an arm that only stands there."""
    rows = len(q)
    zero = np.zeros(rows)
    return State(q, np.zeros(q.shape), zero, zero + 20.0, zero + payload)


def make_katana(seed, *, number=POSES, spread=0.3):
    """An arm with its measurements; `spread` is how far its joints are off the tables, as a share."""
    of_arm, of_joints, inverse_condition, of_noise = (
        np.random.default_rng(s) for s in np.random.SeedSequence([seed, 450]).spawn(4)
    )
    robot = nominal_robot()
    actual = generator.katana().perturbed(of_arm, LENGTH, ANGLE)
    hidden = tilting(spread=spread, rng=of_joints)
    state = still(iso_cube_poses(robot, number, rng=inverse_condition).q)
    seen = poses(actual, hidden, state)
    position = seen[:, :3, 3] + SIGMA[0] * of_noise.standard_normal((number, 3))
    turned = rotation(SIGMA[1] * of_noise.standard_normal((number, 3))) @ seen[:, :3, :3]
    data = Dataset(q=state.q, row=np.arange(number), position=position, rotation=turned)
    return Katana(robot, data, actual, hidden, state)


METER = replace(INSTRUMENTS["inclinometer"], samples=10)
"""An inclinometer on every link, 0.001° a reading, the mean of ten."""


def inclined(actual, hidden, plan, rng):
    """Readings of inclinometers in the postures of a plan: turns about x and y that bring a link's axes from
    upright to where they are [rad].

    The link is turned by the noise before its inclinometer is read; gravity acts along −z.
    """
    links, _ = deflected_links(actual, hidden, still(plan.q, plan.added))
    tilt = {}
    for number, link in enumerate(links, start=1):
        noise = METER.deviations[1] * rng.standard_normal((len(link), 3))
        turned = rotation(noise) @ link[:, :3, :3]
        pair = np.arctan2(turned[:, 2, 1], turned[:, 2, 2]), -np.arcsin(turned[:, 2, 0])
        tilt[number] = np.stack(pair, axis=1)
    return Dataset(q=plan.q, row=np.arange(len(plan.q)), payload=plan.added, tilt=tilt)

"""Rows that a package of its own prepares: the choices that are made for all rows hold for them as well."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.data.dataset import Dataset
from workbench.data.readings import AbstractReadings
from workbench.identification.fit_choices import FitChoices
from workbench.identification.instrument_preparation import AbstractIdentifiability, AbstractPreparation
from workbench.identification.preparation import prepare
from workbench.parts import Parts, register
from workbench.plate.poses.sampling import random_poses


class Touches(AbstractReadings):
    """Nothing beside the rows' own columns."""

    has_tool_poses = False

    def __init__(self, rows):
        self.rows = rows

    def __len__(self):
        return self.rows

    def take(self, rows):
        return Touches(len(np.arange(self.rows)[rows]))

    def joined(self, other):
        return Touches(self.rows + len(other))

    @property
    def numbers(self):
        return np.zeros((self.rows, 0))

    @property
    def sights(self):
        return np.full((self.rows, 4, 4), np.nan)


class Everything(AbstractIdentifiability):
    def found(self, fit):
        return iter(())

    def json(self, fit):
        return {}


class Preparation(AbstractPreparation):
    name = "touches"
    readings = Touches
    undiagnosed = ""

    def contradicted(self, robot, data):
        return {}

    def suited(self, robot, data):
        return data

    def decide(self, robot, data, *, free, build, seek):
        noted = Everything(title="all", refused="", advice="", uncertainty=(0.0, 0.0), notes=("decided",))
        return build(robot, data, free=free), noted

    def comparable(self, held, fitted):
        return held

    def noise_left(self, problem, x):
        return problem.noise


@pytest.fixture
def robot():
    forget = register(Parts(preparations=(Preparation(),)))
    yield load_robot("aria")
    forget()


def test_a_length_that_contacts_can_not_show_is_held(robot):
    rng = np.random.default_rng(0)
    q = robot.search_limits.mean(1) + 0.3 * rng.standard_normal((40, 6))
    plain = Dataset(q=q, row=np.arange(40), contact=np.repeat(["a", "b"], 20))
    known, own = (
        prepare(robot, rows, FitChoices(held_out=0.2)).problem.names
        for rows in (plain, replace(plain, readings=Touches(40)))
    )
    assert own == known
    assert len(set(robot.default_free) - set(own)) == 1


def test_the_decision_about_base_and_tool_is_noted(robot):
    q = random_poses(robot, 30, rng=np.random.default_rng(1))
    poses = tool_poses(robot, Motion(q))
    plain = Dataset(q=q, row=np.arange(30), position=poses[:, :3, 3], rotation=poses[:, :3, :3])
    known, own = (
        prepare(robot, rows, FitChoices(held_out=0.2))
        for rows in (plain, replace(plain, readings=Touches(30)))
    )
    assert own.notes[-1] == "decided"
    assert own.notes[:-1] == known.notes[:-1]
    assert len(own.notes) > 1

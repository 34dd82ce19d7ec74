"""An effect from outside the package: registered once, known from the simulator to the saved arm."""

from dataclasses import dataclass
from typing import final

import numpy as np
import pytest
from gear_sag import GearSag

from tests.session.direct_commands import done
from workbench import load_plate, load_robot, read_measurements, write_measurements
from workbench.arm.effects import AbstractEffect
from workbench.arm.robot_toml import read_toml, write_toml
from workbench.base.errors import RobotError
from workbench.data.simulation.hidden_effects import hidden_effects
from workbench.parts import Parts, register
from workbench.plate.simulated_measurement import measure_poses
from workbench.session import start
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.identify import Identify

SIZE = 4e-4
SENTENCE = "Joint 2 winds up by"


@final
@dataclass(frozen=True)
class WarmJoint(AbstractEffect):
    """A joint whose zero follows the temperature; a law and a sentence."""

    name = "warm-joint"
    needs = ("temperature",)

    def law(self, chain, motion, wrenches):
        warmer = motion.need("temperature", self.name) - 20.0
        return np.tile(warmer[:, None, None], (1, 1, len(self.joints))) * np.eye(len(self.joints))

    def sentence(self, chain, motion):
        return f"{self.where} follows the temperature by {self.size(chain)} per kelvin"


@final
@dataclass(frozen=True)
class Shrink(AbstractEffect):
    """All joints read too little alike, with three elements and one coefficient."""

    name = "shrink"
    whole_arm = True

    def elements(self, chain):
        return tuple(chain.elements[chain.driven[j]].name for j in range(3))

    def law(self, chain, motion, wrenches):
        return -np.sin(motion.q[:, :3, None])

    def sentence(self, chain, motion):
        return f"the arm shrinks by {self.size(chain)}"


KINDS = (GearSag, WarmJoint, Shrink)


@pytest.fixture(scope="module", autouse=True)
def registered():
    forget = register(Parts(effects=KINDS))
    yield
    forget()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("foreign")


@pytest.fixture(scope="module")
def found(folder):
    """The session of an app in which a file of such an arm was diagnosed, and the effect added."""
    _, rows = measure_poses(load_robot("aria"), 90, effects=(f"gear-sag:2:{SIZE}",), seed=2)
    path = write_measurements(rows, folder / "sag.csv")
    commands = (LoadData(path.name, path.read_bytes()), Identify(), Diagnose(), AddEffects())
    return done(start(load_robot("aria"), load_plate("table2")), *commands)


def test_the_app_finds_adds_and_compares_it(found):
    diagnosis = found.results.diagnosis
    (accepted,) = diagnosis.effects
    assert isinstance(accepted.effect, GearSag)
    assert accepted.effect.joints == (1,)
    assert accepted.effect.coefficients[0] == pytest.approx(SIZE, abs=4.0 * accepted.std[0])
    assert accepted.text.startswith(SENTENCE)
    assert diagnosis.message.startswith(SENTENCE)
    assert str(diagnosis.verdict) == "explained"
    assert [type(e) for e in found.results.accepted] == [GearSag]
    run = found.results.identification.runs[found.results.fit]
    assert [type(e) for e in run.calibrated.effects] == [GearSag]
    assert run.held_out.position_mm.mean < 0.15
    assert any(SENTENCE in message.text for message in found.page.messages)


def test_sizes_have_defaults():
    """A law and a sentence make an example that shows, and units."""
    robot = load_robot("aria")
    rng = np.random.default_rng(0)
    for name in ("gear-sag", "warm-joint", "shrink"):
        (effect,), _ = hidden_effects(robot, [name], rng=rng)
        assert effect.units(robot.with_effects(effect).chain) == ("rad",)


def test_a_saved_arm_comes_back(tmp_path):
    warm = load_robot("aria").with_effects(WarmJoint((2, 4), (1e-5, 2e-5)), Shrink((), (1e-4,)))
    again = read_toml(write_toml(warm, tmp_path / "warm.toml"))
    assert again.effects == warm.effects
    assert list(again.coefficients) == ["joint3.warm_joint", "joint5.warm_joint", "arm.shrink"]
    with pytest.raises(RobotError, match="whole"):
        warm.with_effects(Shrink((1,)))


def test_measured_rows_know_their_drivers(folder, found):
    """What the simulator wrote for a foreign effect is what its law needs."""
    rows = read_measurements(folder / "sag.csv")
    assert rows.payload is not None
    assert np.ptp(rows.payload) > 0.0
    _, warm = measure_poses(load_robot("aria"), 20, effects=("warm-joint:3",), seed=1)
    assert warm.temperature is not None

"""An effect from outside the package: registered once, known from the simulator to the saved arm."""

from dataclasses import dataclass
from typing import final

import numpy as np
import pytest
from gear_sag import GearSag

from workbench import load_robot
from workbench.arm.effects import AbstractEffect
from workbench.arm.robot_toml import read_toml, write_toml
from workbench.base.errors import RobotError
from workbench.data.simulation.hidden_effects import hidden_effects
from workbench.parts import Parts, register


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


KINDS = (GearSag, Shrink)


@pytest.fixture(scope="module", autouse=True)
def registered():
    forget = register(Parts(effects=KINDS))
    yield
    forget()


def test_sizes_have_defaults(aria):
    """A law and a sentence make an example that shows, and units."""
    rng = np.random.default_rng(0)
    for name in ("gear-sag", "shrink"):
        (effect,), _ = hidden_effects(aria, [name], rng=rng)
        assert effect.units(aria.with_effects(effect).chain) == ("rad",)


def test_a_saved_arm_comes_back(tmp_path):
    sagging = load_robot("aria").with_effects(GearSag((2, 4), (1e-5, 2e-5)), Shrink((), (1e-4,)))
    again = read_toml(write_toml(sagging, tmp_path / "sagging.toml"))
    assert again.effects == sagging.effects
    assert list(again.coefficients) == ["joint3.gear_sag", "joint5.gear_sag", "arm.shrink"]
    with pytest.raises(RobotError, match="whole"):
        sagging.with_effects(Shrink((1,)))
